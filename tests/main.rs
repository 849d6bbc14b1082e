//! Behaviour of the program and the library, on samples that they make themselves.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, unreachable_pub)]

#[path = "behaviour/advice.rs"]
mod advice;
#[path = "behaviour/archives.rs"]
mod archives;
#[path = "behaviour/at_once.rs"]
mod at_once;
#[path = "behaviour/bad_input.rs"]
mod bad_input;
#[path = "behaviour/baselines.rs"]
mod baselines;
#[path = "behaviour/check.rs"]
mod check;
#[path = "behaviour/clusters.rs"]
mod clusters;
#[path = "behaviour/coherent.rs"]
mod coherent;
#[path = "behaviour/coherent_damage.rs"]
mod coherent_damage;
#[path = "behaviour/coherent_example.rs"]
mod coherent_example;
#[path = "behaviour/command_line.rs"]
mod command_line;
#[path = "behaviour/components.rs"]
mod components;
#[path = "behaviour/contradictions.rs"]
mod contradictions;
#[path = "behaviour/crafted_stores.rs"]
mod crafted_stores;
#[path = "behaviour/curve.rs"]
mod curve;
#[path = "behaviour/damaged_stores.rs"]
mod damaged_stores;
#[path = "behaviour/dead_ends.rs"]
mod dead_ends;
#[path = "behaviour/deepzoom.rs"]
mod deepzoom;
#[path = "behaviour/determinism.rs"]
mod determinism;
#[path = "behaviour/document_pictures.rs"]
mod document_pictures;
#[path = "behaviour/equations.rs"]
mod equations;
#[path = "behaviour/examples.rs"]
mod examples;
#[path = "behaviour/fixture.rs"]
mod fixture;
#[path = "behaviour/forged_stores.rs"]
mod forged_stores;
#[path = "behaviour/input_words.rs"]
mod input_words;
#[path = "behaviour/interruption.rs"]
mod interruption;
#[path = "behaviour/judging.rs"]
mod judging;
#[path = "behaviour/lattices.rs"]
mod lattices;
#[path = "behaviour/losses.rs"]
mod losses;
#[path = "behaviour/many.rs"]
mod many;
#[path = "behaviour/odd_archives.rs"]
mod odd_archives;
#[path = "behaviour/option_effects.rs"]
#[allow(dead_code)] // the program's own tests read the rest
mod option_effects;
#[path = "behaviour/packed_sources.rs"]
mod packed_sources;
#[path = "behaviour/paper_bytes.rs"]
mod paper_bytes;
#[path = "behaviour/picture_formats.rs"]
mod picture_formats;
#[path = "behaviour/pictures.rs"]
mod pictures;
#[path = "behaviour/places.rs"]
mod places;
#[path = "behaviour/reading.rs"]
mod reading;
#[path = "behaviour/readme.rs"]
mod readme;
#[path = "behaviour/real_data.rs"]
mod real_data;
#[path = "behaviour/recipes.rs"]
mod recipes;
#[path = "behaviour/rendering.rs"]
mod rendering;
#[path = "behaviour/resident_memory.rs"]
mod resident_memory;
#[path = "behaviour/safety.rs"]
mod safety;
#[path = "behaviour/setup.rs"]
mod setup;
#[path = "behaviour/shares.rs"]
mod shares;
#[path = "behaviour/slurm.rs"]
mod slurm;
#[path = "behaviour/tiles.rs"]
mod tiles;
#[path = "behaviour/verify.rs"]
mod verify;
#[path = "behaviour/viewer.rs"]
mod viewer;
