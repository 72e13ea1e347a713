//! The figures of `mauve wcrt --method paper`: those of the paper's Table 3, which are no bounds.

use mauve_timing::{Level, Tasks, Time, published_response_times};

use crate::text::{columns, csv, number};

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
        let (levels, all): (Vec<Level>, Vec<_>) = self.figures().unzip();
        let levels: Vec<String> = levels.iter().map(Level::to_string).collect();
        let header: Vec<&str> =
            std::iter::once("instance").chain(levels.iter().map(String::as_str)).collect();
        let names = all.first().into_iter().flatten().map(|(name, _)| vec![name.clone()]);
        let mut rows: Vec<Vec<String>> = names.collect();
        for figures in &all {
            rows.iter_mut().zip(figures).for_each(|(row, (_, time))| row.push(number(*time)));
        }
        format!(
            "{}: response times in ms as the paper computes them\n{}  UNSAFE: they count no interference after the hyperperiod, \
             and are not bounds\n",
            self.name,
            columns(&header, &rows)
        )
    }
}

/// Returns a row for each deployment, level and instance.
pub(super) fn published_csv(all: &[Published]) -> String {
    let mut rows = Vec::new();
    for it in all {
        for (level, figures) in it.figures() {
            rows.extend(figures.into_iter().map(|(instance, time)| {
                let time = time.map(Time::number).unwrap_or_default();
                vec![it.name.clone(), level.to_string(), instance, time]
            }));
        }
    }
    csv("deployment,significance,instance,unsafe_response_ms", rows)
}
