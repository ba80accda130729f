//! Elements of an XML file, with errors that name file, line, element and attribute.

use std::path::Path;

use roxmltree::{Document, Node};

use crate::cli::Failure;

/// An XML file.
pub struct Source<'a> {
    /// Its name, for messages.
    pub file: &'a str,
    /// Its folder.
    pub folder: &'a Path,
    /// Its content.
    pub document: &'a Document<'a>,
}

impl Source<'_> {
    /// Line of an element, from 1.
    pub fn line(&self, node: Node) -> u32 {
        self.document.text_pos_at(node.range().start).row
    }

    /// An error at an element.
    pub fn error(&self, node: Node, message: &str) -> Failure {
        let own = node.attribute("name").map_or_else(String::new, |name| format!(" {name}"));
        Failure::usage(format!("{}:{}: {}{own}: {message}", self.file, self.line(node), node.tag_name().name()))
    }

    /// An error at an attribute.
    pub fn error_in(&self, node: Node, key: &str, message: &str) -> Failure {
        let value = node.attribute(key).unwrap_or_default();
        self.error(node, &format!("{key} = \"{value}\": {message}"))
    }

    /// The attribute `key`.
    ///
    /// # Errors
    /// There is none.
    pub fn require<'n>(&self, node: Node<'n, '_>, key: &str) -> Result<&'n str, Failure> {
        node.attribute(key).ok_or_else(|| self.error(node, &format!("the attribute `{key}` is missing")))
    }

    /// The numbers of `text`, the value of `key`; between `least` and `most` of them.
    ///
    /// # Errors
    /// Another number of them, a word in place of one, or one that is not finite.
    pub fn parse(&self, node: Node, key: &str, text: &str, [least, most]: [usize; 2]) -> Result<Vec<f64>, Failure> {
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
        let numbers = numbers.filter(|all| (least..=most).contains(&all.len()) && all.iter().all(|x| x.is_finite()));
        numbers.ok_or_else(|| {
            let expected = if least == most { least.to_string() } else { format!("{least} to {most}") };
            let numbers = if most == 1 { "number" } else { "numbers" };
            self.error(node, &format!("{key} = \"{text}\": expected {expected} {numbers}"))
        })
    }

    /// The `N` numbers of the attribute `key`, if it is there.
    ///
    /// # Errors
    /// As [`Self::parse`].
    pub fn numbers<const N: usize>(&self, node: Node, key: &str) -> Result<Option<[f64; N]>, Failure> {
        let Some(text) = node.attribute(key) else {
            return Ok(None);
        };
        Ok(self.parse(node, key, text, [N, N])?.try_into().ok())
    }

    /// The number of the attribute `key`, if it is there.
    ///
    /// # Errors
    /// As [`Self::parse`].
    pub fn number(&self, node: Node, key: &str) -> Result<Option<f64>, Failure> {
        Ok(self.numbers::<1>(node, key)?.map(|[number]| number))
    }
}

/// The first child element of this name.
pub fn child<'n, 'i>(node: Node<'n, 'i>, name: &str) -> Option<Node<'n, 'i>> {
    node.children().find(|child| child.has_tag_name(name))
}
