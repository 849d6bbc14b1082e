use std::path::PathBuf;
use std::process::{Command, Stdio};

use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::shape::Area;
use btfkit::view::{Options, Viewer};
use clap::Args;

use super::{Console, bytes_text, found};

/// Look at a material in a browser: move the light, turn the material, walk over an endless surface
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf view wood.model.zarr --open                   in your browser, until you press Ctrl-C
  btf view wood.model.zarr --export wood.html       one file, for others; it needs no network
  btf view wood-4k.zarr --export part.html --window 512,0,1024,1024
Only this machine can open the served page. It needs a browser of 2023 or newer, with WebGL 2.")]
pub(super) struct View {
    /// A model or an enlargement
    source: PathBuf,
    /// Write the page with everything in it to this file, instead of serving it
    #[arg(long, value_name = "PAGE")]
    export: Option<PathBuf>,
    /// The model of an enlargement [default: where it was when the enlargement was made; else of that name beside it
    /// or in the current folder]
    #[arg(long)]
    model: Option<PathBuf>,
    /// The part of an enlargement that the page holds: x,y,width,height in texels, at most 1024 a side
    #[arg(long, allow_hyphen_values = true)]
    window: Option<Area>,
    /// Port to serve the page on [default: any that is free]
    #[arg(long, conflicts_with = "export")]
    port: Option<u16>,
    /// Open the page in the browser
    #[arg(long, conflicts_with = "export")]
    open: bool,
}

impl View {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        let options = Options { source: self.source.clone(), model: self.model.clone(), window: self.window };
        let viewer = Viewer::open(&options, context)?;
        console.notes(viewer.notes());
        if let Some(path) = &self.export {
            let report = viewer.export(path, context)?;
            console.line(format!("{}: {}{}", path.display(), bytes_text(report.bytes), found(report.made)));
            return Ok(());
        }
        let server = viewer.serve(self.port.unwrap_or(0))?;
        let address = server.address();
        console.line(&address);
        console.line("Ctrl-C ends it.");
        if self.open && !open(&address) {
            console.line("no browser could be started: open the address by hand");
        }
        server.run(context)
    }
}

/// Asks the system to open an address; whether somebody took it.
fn open(address: &str) -> bool {
    let opener = match std::env::consts::OS {
        "macos" => "open",
        "windows" => "explorer",
        _ => "xdg-open",
    };
    let quiet = Stdio::null;
    Command::new(opener).arg(address).stdin(quiet()).stdout(quiet()).stderr(quiet()).spawn().is_ok()
}
