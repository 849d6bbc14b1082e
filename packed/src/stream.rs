//! The order in which everything is coded; encoder and decoder go through it alike.
//!
//! Section s brings all numbers to plane `low = sections - 1 - s`: first the mean, then one component after another, its
//! basis before its coefficients. A component that begins late goes through its upper planes then.

use crate::grid::{Before, Contexts, Grid, Kind, Shape, Wanted, code_plane};
use crate::range_coder::Coder;
use crate::spectrum::Transforms;

/// The numbers of a component in units of the finest step; empty in a decoder.
#[derive(Clone, Copy, Default)]
pub(crate) struct Truth<'a> {
    pub(crate) basis: &'a [i32],
    pub(crate) image: &'a [i32],
}

/// What is known of all numbers.
pub(crate) struct Stream {
    pub(crate) brdf: Shape,
    pub(crate) image: Shape,
    planes: u32,
    pub(crate) mean: Grid,
    pub(crate) bases: Vec<Grid>,
    pub(crate) images: Vec<Grid>,
    contexts: [Contexts; 2],
    /// The plane that the mean is known to; `planes` before the first.
    reached: u32,
    reached_components: Vec<u32>,
}

/// The probabilities and the number of components at some point.
pub(crate) struct Mark {
    contexts: [Contexts; 2],
    components: usize,
}

impl Stream {
    /// Before the first section.
    pub(crate) fn new(transforms: &Transforms, channels: usize, planes: u32) -> Self {
        let (degrees, [rows, columns]) = (transforms.degrees(), transforms.frequencies());
        let brdf = Shape::new(Kind::Brdf, channels, degrees[0], degrees[1], planes);
        let image = Shape::new(Kind::Image, 1, &rows, &columns, planes);
        Self {
            mean: Grid::new(&brdf),
            brdf,
            image,
            planes,
            bases: vec![],
            images: vec![],
            contexts: [Contexts::new(), Contexts::new()],
            reached: planes,
            reached_components: vec![],
        }
    }

    /// Where it is.
    pub(crate) fn mark(&self) -> Mark {
        Mark { contexts: self.contexts.clone(), components: self.bases.len() }
    }

    /// Forgets components that began after a mark.
    pub(crate) fn return_to(&mut self, mark: Mark) {
        self.contexts = mark.contexts;
        self.bases.truncate(mark.components);
        self.images.truncate(mark.components);
        self.reached_components.truncate(mark.components);
    }

    /// Brings the mean to a plane.
    pub(crate) fn code_mean(&mut self, coder: &mut impl Coder, low: u32, truth: &[i32]) {
        for plane in (low..self.reached).rev() {
            let contexts = &mut self.contexts[0];
            let before = Before { grids: [None; 3], shift: 0 };
            let wanted = Wanted { numbers: truth, low: plane };
            code_plane(coder, contexts, &self.brdf, &mut self.mean, before, wanted);
        }
        self.reached = low;
    }

    /// Brings a component to a plane; the next one begins.
    pub(crate) fn code_component(
        &mut self,
        coder: &mut impl Coder,
        number: usize,
        low: u32,
        truth: Truth<'_>,
    ) {
        if number == self.bases.len() {
            self.bases.push(Grid::new(&self.brdf));
            self.images.push(Grid::new(&self.image));
            self.reached_components.push(self.planes);
        }
        let [brdf, image] = &mut self.contexts;
        let high = self.reached_components[number];
        for (contexts, shape, grids, truth) in [
            (brdf, &self.brdf, &mut self.bases, truth.basis),
            (image, &self.image, &mut self.images, truth.image),
        ] {
            let (done, from) = grids.split_at_mut(number);
            let done = [1, 2, 3].map(|back| number.checked_sub(back).map(|at| &done[at]));
            for plane in (low..high).rev() {
                let before = Before { grids: done, shift: plane - low };
                let wanted = Wanted { numbers: truth, low: plane };
                code_plane(coder, contexts, shape, &mut from[0], before, wanted);
            }
        }
        self.reached_components[number] = low;
    }
}
