//! Tests of texts: scene files, documents and the sources themselves.

mod documents;
mod drives;
mod format;
mod icons;
mod joints;
mod meshes;
mod scene_corpus;
mod scene_errors;
