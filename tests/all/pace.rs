//! The time that is left of a stage whose items differ in what they take.

#![allow(clippy::unwrap_used)]

use std::time::Instant;

use strandline::exec::Workers;

use crate::common::lab::Lab;

/// Three light items and one that counts for three, of nine steps: what is left is half of what was done.
#[test]
fn items_count_as_they_are_weighed() {
    let lab = Lab::new(1);
    let engine = &lab.engine;
    engine.outlook().expect(vec![("shape".into(), 1.0)]);
    let outside = Instant::now();
    let stage = engine.stage("shape", 0);
    let inside = Instant::now();
    let run = |items: usize| {
        let waited = stage.run(&vec![(); items], &Workers::none(), |(), ()| {
            std::thread::sleep(std::time::Duration::from_millis(5));
            Ok(())
        });
        waited.unwrap();
    };
    stage.weigh(0);
    run(1);
    stage.expect(9);
    stage.weigh(1);
    run(3);
    stage.weigh(3);
    run(1);
    let least = inside.elapsed().as_secs_f64();
    let left = engine.outlook().left().unwrap();
    let most = outside.elapsed().as_secs_f64();
    assert!((0.5 * least..=0.5 * most).contains(&left), "{left} of {least} to {most}");
    stage.finish();
}
