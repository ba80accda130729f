//! What is read: scene files, documents, the sources themselves.

mod documents;
mod drives;
mod house;
mod joints;
mod scene_corpus;
mod scene_errors;
