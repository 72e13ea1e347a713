//! The files of a library's classes.

use super::{Class, header, source};
use crate::generated_file::GeneratedFile;
use crate::library::Model;

/// Returns the class files of a library's components.
pub(crate) fn component_files(model: Model<'_, '_>) -> Vec<GeneratedFile> {
    let components = model.library.components.iter();
    let classes = components.filter_map(|(component, name)| Class::new(model, *component, name));
    let files = classes.flat_map(|class| {
        [("hpp", header::text(&class)), ("cpp", source::text(&class))].map(|(extension, text)| {
            GeneratedFile::generated(format!("{0}/{0}-component.{extension}", class.name), text)
        })
    });
    files.collect()
}
