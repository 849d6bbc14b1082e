//! BTF values of clusters, under any view and light.

pub mod evaluate;
pub mod triangulation;
