//! The figures of `mauve wcrt --method paper`: those of the paper's Table 3, which are no bounds.

use mauve_timing::{Level, Tasks, Time, published_response_times};

use crate::text::{Sheet, csv_number, number};

/// A deployment at several levels.
pub(super) struct Published {
    pub(super) name: String,
    pub(super) tasks: Vec<(Level, Tasks)>,
}

impl Published {
    /// Returns the instances with the figure of each, by level.
    fn figures(&self) -> impl Iterator<Item = (Level, Vec<(String, Option<Time>)>)> {
        self.tasks.iter().map(|(level, tasks)| {
            let found = published_response_times(tasks.all());
            let names = tasks.activities().iter().map(|it| it.name.to_string());
            (*level, names.zip(found).collect())
        })
    }

    /// Returns the figures for people: a row for each instance, a column for each level.
    pub(super) fn table(&self) -> String {
        let instances = self.tasks.first().map_or(&[][..], |(_, tasks)| tasks.activities());
        let instances: Vec<_> = instances.iter().enumerate().collect();
        let mut sheet = Sheet::of(&instances).column("instance", |(_, it)| it.name.to_string());
        for (level, all) in self.figures() {
            let time = |index: usize| all.get(index).and_then(|(_, time)| *time);
            sheet = sheet.column(level.to_string(), |(index, _)| number(time(*index)));
        }
        format!(
            "{}: response times in ms as the paper computes them\n{}  UNSAFE: they count no interference after the hyperperiod, \
             and are not bounds\n",
            self.name,
            sheet.text()
        )
    }
}

/// Returns a row for each deployment, level and instance.
pub(super) fn published_csv(all: &[Published]) -> String {
    let rows = all.iter().flat_map(|it| {
        let of_level =
            move |(level, figures): (Level, Vec<_>)| figures.into_iter().map(move |it| (level, it));
        it.figures().flat_map(of_level).map(move |(level, (instance, time))| (it, level, instance, time))
    });
    Sheet::of(&rows.collect::<Vec<_>>())
        .column("deployment", |(it, ..)| it.name.clone())
        .column("significance", |(_, level, ..)| level.to_string())
        .column("instance", |(_, _, instance, _)| instance.clone())
        .column("unsafe_response_ms", |(.., time)| csv_number(*time))
        .csv()
}
