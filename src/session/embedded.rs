//! Panels of a window embedded in another page.

/// A panel beside the picture of an embedded window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The first sliders.
    Controls,
    /// Lanes of the joints with play.
    Timeline,
    /// The visible plots.
    Plots,
    /// The chaos bench.
    Bench,
}

const PARTS: [(&str, Part); 4] =
    [("controls", Part::Controls), ("timeline", Part::Timeline), ("plots", Part::Plots), ("bench", Part::Bench)];

/// Which panels an embedded window has.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Embedded(Vec<Part>);

impl Embedded {
    /// Reads words separated by commas or spaces; without any, only the picture and its bar are shown.
    ///
    /// # Errors
    /// An unknown word; lists the allowed ones.
    pub fn read(text: &str) -> Result<Self, String> {
        let words = text.split([',', ' ']).filter(|word| !word.is_empty());
        let parts = words.map(|word| {
            let part = PARTS.iter().find(|(name, _)| *name == word);
            part.map(|(_, part)| *part).ok_or_else(|| {
                let all = PARTS.map(|(word, _)| word).join(", ");
                format!("no panel `{word}`; allowed, separated by commas: {all}")
            })
        });
        Ok(Self(parts.collect::<Result<_, _>>()?))
    }

    /// The panel of the first sliders alone.
    pub fn with_controls() -> Self {
        Self(vec![Part::Controls])
    }

    /// The reverse of [`Self::read`].
    pub fn write(&self) -> String {
        let words = PARTS.iter().filter(|(_, part)| self.contains(*part));
        words.map(|(word, _)| *word).collect::<Vec<_>>().join(",")
    }

    /// Whether `part` is shown.
    pub fn contains(&self, part: Part) -> bool {
        self.0.contains(&part)
    }
}
