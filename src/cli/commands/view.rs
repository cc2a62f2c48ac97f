//! `strandline view`: results in the browser, until it is interrupted or the time is over.

use crate::cli::args::view::ViewArgs;
use crate::cli::print;
use crate::cli::terminal::console::{Console, Voice};
use crate::cli::terminal::signals;
use crate::error::Result;
use crate::exec::Progress;
use crate::view::{Server, Settings, Shown, links};

/// Runs the command.
pub(crate) fn run(args: &ViewArgs) -> Result<()> {
    let shown = Shown::of(&args.path)?;
    let cancel = signals::cancel_on_signals()?;
    let server = Server::listen(Settings { port: args.port, within: args.within })?;
    let origin = server.origin();
    print(&if args.print_links { links(&shown, &origin) } else { format!("{origin}/\n") })?;
    let console = Console::new(Voice::of(false, false));
    if !args.no_open && open::that_detached(&origin).is_err() {
        console.note(&format!("no browser could be started; open {origin}/ in one"));
    }
    if args.within.is_none() {
        console.note("ends at Ctrl-C");
    }
    server.serve(shown, &cancel)
}
