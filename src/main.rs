//! `btf`: measured Bidirectional Texture Functions in, enlarged materials out.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
