//! What a reader had to assume, and about what, so that whoever knows better can take the assumption back.

use std::fmt;
use std::ops::Deref;

/// What an assumption is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum About {
    /// The transfer curve of the samples.
    Transfer,
    /// Whether the cosine of the light's angle is in the samples.
    Cosine,
    /// Where azimuths begin, and which way they run.
    Azimuths,
    /// The directions of the views, which the archive does not give.
    Views,
    /// Anything else.
    Other,
}

/// Something that had to be assumed because the archive does not say it: a sentence for people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assumption {
    /// What it is about.
    pub about: About,
    /// The sentence.
    pub text: String,
}

impl Assumption {
    /// About the transfer curve.
    pub fn transfer(text: impl Into<String>) -> Self {
        Self { about: About::Transfer, text: text.into() }
    }

    /// About the cosine of the light's angle.
    pub fn cosine(text: impl Into<String>) -> Self {
        Self { about: About::Cosine, text: text.into() }
    }

    /// About azimuths.
    pub fn azimuths(text: impl Into<String>) -> Self {
        Self { about: About::Azimuths, text: text.into() }
    }

    /// About the directions of the views.
    pub fn views(text: impl Into<String>) -> Self {
        Self { about: About::Views, text: text.into() }
    }
}

impl<T: Into<String>> From<T> for Assumption {
    fn from(text: T) -> Self {
        Self { about: About::Other, text: text.into() }
    }
}

impl Deref for Assumption {
    type Target = str;

    fn deref(&self) -> &str {
        &self.text
    }
}

impl fmt::Display for Assumption {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.text)
    }
}
