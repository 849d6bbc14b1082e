//! How a stage tells how far it is. The library never prints; the program draws bars.

/// What a count counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counted {
    /// Things, by the name of one in the plural ("images").
    Items(&'static str),
    /// Bytes.
    Bytes,
}

/// Receives the progress of a stage. All methods may be called from any thread.
pub trait Progress: Sync {
    /// A step of the work begins, of `total` counts.
    fn begin(&self, title: &str, total: u64, counted: Counted);
    /// `count` more are done.
    fn advance(&self, count: u64);
    /// A word beside the bar: the objective of a pass, say.
    fn remark(&self, text: &str);
    /// The step has ended.
    fn end(&self);
    /// Something that the user should know at once: that another process is waited for, say.
    fn notice(&self, _text: &str) {}
}

/// Progress that nobody watches.
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _: &str, _: u64, _: Counted) {}
    fn advance(&self, _: u64) {}
    fn remark(&self, _: &str) {}
    fn end(&self) {}
}
