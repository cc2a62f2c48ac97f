//! Completions and manual pages: a shell takes the first, and every command has one of the second.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::process::Command;

use crate::common::ball::Bench;

#[test]
fn a_shell_takes_its_completions_and_completes_flags() {
    let bench = Bench::bare();
    bench.write("strandline.bash", &bench.succeed("completions bash"));
    let asked = "source ./strandline.bash; COMP_WORDS=(strandline segment --mem); COMP_CWORD=2; \
                 _strandline strandline --mem segment; echo ${COMPREPLY[@]}";
    let shell = Command::new("bash").args(["-c", asked]).current_dir(bench.path("")).output().unwrap();
    let completed = String::from_utf8(shell.stdout).unwrap();
    assert_eq!(completed.trim(), "--memory", "{}", String::from_utf8_lossy(&shell.stderr));
    assert!(bench.fail("completions basic", 2).contains("basic"));
}

#[test]
fn every_command_has_a_manual_page_with_its_flags() {
    let bench = Bench::bare();
    bench.succeed("man pages/man1");
    for (command, flag) in
        [("segment", "points"), ("distance", "signed"), ("middle", "surface"), ("view", "print"), ("info", "json")]
    {
        let page = fs::read_to_string(bench.path(&format!("pages/man1/strandline-{command}.1"))).unwrap();
        assert!(page.contains(".TH") && page.contains(flag), "{command}");
    }
}
