//! Random models whose activities have all fields: rates, lists of CPUs, triggers, late deadlines, shared threads and clocks.

use crate::Random;
use crate::model::{Activity, Declaration, Model};

impl Model {
    /// Returns the model with other fields of its activities. They may have warnings, but no errors of the language.
    pub fn varied(mut self, seed: u64) -> Model {
        let mut random = Random::of_seed(seed ^ 0x0a11_f1e1);
        let declarations =
            || self.files.iter().flat_map(|it| &it.libraries).flat_map(|(_, declarations)| declarations);
        let architectures = declarations().filter_map(|it| match it {
            Declaration::Architecture(architecture) => Some(architecture),
            _ => None,
        });
        let inputs: Vec<(String, String)> =
            architectures.flat_map(|it| &it.connections).map(|it| it.target.clone()).collect();
        let mut released = Vec::new();
        let all = self.files.iter_mut().flat_map(|it| &mut it.libraries).flat_map(|(_, all)| all);
        for declaration in all {
            let Declaration::Deployment(deployment) = declaration else { continue };
            for activity in &mut deployment.activities {
                let input = inputs.iter().find(|(instance, _)| *instance == activity.instance);
                vary(activity, input.map(|(_, port)| port.as_str()), &mut random);
                if activity.fields.iter().any(|it| it.0 == "period") {
                    released.push(activity.instance.clone());
                }
            }
        }
        if released.len() > 1
            && random.below(2) == 0
            && let Some(config) = self.tomls.first_mut()
        {
            let clock = released.split_off(released.len() / 2);
            for (header, key, all) in
                [("clocks", "synchronised", released), ("clocks.drive", "instances", clock)]
            {
                config.sections.push((header.to_owned(), vec![(key.to_owned(), format!("{all:?}"))]));
            }
        }
        self
    }
}

fn vary(activity: &mut Activity, input: Option<&str>, random: &mut Random) {
    let fields = &mut activity.fields;
    if fields.iter().any(|it| it.1 == "background") {
        return;
    }
    let mut field = |name: &str, value: String| fields.push((name.to_owned(), value));
    if random.below(6) == 0 {
        field("jitter", "11/4".to_owned());
    }
    let is_triggered = input.is_some() && random.below(3) == 0;
    if let Some(port) = input.filter(|_| is_triggered) {
        field("trigger", port.to_owned());
        if random.below(3) == 0 {
            field("burst", "2".to_owned());
        }
    }
    let least = ["least", "period"][random.below(2)];
    for (name, value) in fields.iter_mut() {
        match (name.as_str(), random.below(4)) {
            ("period", 0) => *value = format!("{value}/1"),
            ("period", 1) if !is_triggered => {
                (*name, *value) = ("rate".to_owned(), format!("1000/{value} Hz"))
            }
            ("period", _) if is_triggered => *name = least.to_owned(),
            ("affinity", 0) if !value.starts_with("0x") => {
                let cpu = value.parse::<u32>().map_or(1, |mask| mask.trailing_zeros() + 1);
                (*name, *value) = ("cpus".to_owned(), format!("[{cpu}]"));
            }
            ("affinity", 1) => (*name, *value) = ("cpus".to_owned(), "[1]".to_owned()),
            // Later than the period, since a random period has four digits at most.
            ("deadline", 0) => *value = "1250/1".to_owned(),
            _ => {}
        }
    }
    // On all CPUs.
    if random.below(5) == 0 {
        fields.retain(|it| it.0 != "affinity" && it.0 != "cpus");
    }
}
