//! What is read: scene files, documents, the sources themselves.

mod documents;
mod drives;
mod format;
mod house;
mod icons;
mod joints;
mod meshes;
mod scene_corpus;
mod scene_errors;
