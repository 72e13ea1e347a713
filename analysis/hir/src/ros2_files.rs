//! Files of ROS 2 as inputs: texts to plain data with the place of each value, and changes of single values to edits of the text.
//!
//! | file | contents |
//! |---|---|
//! | `yaml.rs`, `kept_yaml.rs` | a YAML file as a tree with places; the tree of the last text, for the next one |
//! | `problem.rs`, `value.rs` | what is wrong in a file; values that are absent, unknown or known |
//! | `threads.rs`, `group_id.rs` | `threads.yaml`: the threads of the callback-isolated executor; ids of callback groups |
//! | `controllers.rs` | `controllers.yaml`: the control loop of ros2_control, and its controllers |
//! | `named_paths.rs` | `architecture.yaml`: the paths of CARET |
//! | `edit.rs` | a changed priority, policy or affinity as edits, which change no other byte |
//!
//! A value that cannot be read is unknown, and never absent: the reader of the file may read it.

mod controllers;
mod edit;
mod group_id;
mod kept_yaml;
mod named_paths;
mod problem;
mod threads;
mod value;
mod yaml;

pub use controllers::{
    Controller, ControllerManager, ControllersFile, DEFAULT_THREAD_PRIORITY, DEFAULT_UPDATE_RATE,
    read_controllers,
};
pub use edit::{EditRefusal, ThreadChange, YamlEdit, apply_edits, change_thread};
pub use group_id::{GroupId, InvalidGroupId, timer_period};
pub(crate) use kept_yaml::KeptYaml;
pub use named_paths::{NamedPath, PathNode, read_named_paths};
pub use problem::{ExpectedValue, FileProblem, FileProblemKind};
pub use threads::{ThreadEntry, ThreadPlace, ThreadPolicy, ThreadsFile, read_threads};
pub use value::YamlValue;
