//! `btf`: measured Bidirectional Texture Functions in, enlarged materials out.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
