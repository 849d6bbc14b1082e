//! BTF values of clusters, under any view and light.

pub mod components;
pub(crate) mod evaluate;
pub(crate) mod triangulation;
