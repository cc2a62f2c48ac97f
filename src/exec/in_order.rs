//! Results taken in order while the next are worked on.

use super::engine::Stage;
use super::workers::Workers;
use crate::error::Result;

/// Works on items, `batch` of them at a time, as [`Stage::run`] does, and gives each result to `take`, in order. While some are taken, by the
/// thread that calls, the next are worked on; a stage of one thread does one after the other. At most two batches of results are held.
///
/// # Errors
/// The first failure of `work` or `take`, or the signal that ended the run.
pub fn run_in_order<I, W, R>(
    stage: &Stage<'_>,
    (items, batch): (&[I], usize),
    workers: &Workers<W>,
    work: impl Fn(&mut W, &I) -> Result<R> + Sync,
    mut take: impl FnMut(&I, R) -> Result<()>,
) -> Result<()>
where
    I: Sync,
    W: Send,
    R: Send,
{
    let parts: Vec<&[I]> = items.chunks(batch).collect();
    let run = |n: usize| parts.get(n).map_or(Ok(Vec::new()), |part| stage.run(part, workers, &work));
    let is_one = stage.threads() == 1;
    let mut made = run(0)?;
    for (n, part) in parts.iter().enumerate() {
        let mut next = Ok(Vec::new());
        let taken = stage.engine().pool().in_place_scope(|scope| {
            if !is_one {
                scope.spawn(|_| next = run(n + 1));
            }
            part.iter().zip(std::mem::take(&mut made)).try_for_each(|(item, result)| take(item, result))
        });
        taken?;
        made = if is_one { run(n + 1)? } else { next? };
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::error::Error;
    use crate::exec::{Budget, Cancel, Engine, Silent};
    use crate::store::Scratch;

    fn with_threads(threads: usize, job: impl FnOnce(&Stage<'_>)) {
        let folder = tempfile::tempdir().unwrap();
        let scratch = Scratch::new(folder.path(), 1 << 20);
        let engine =
            Engine::new(threads, scratch, Budget { total: 1 << 26 }, Cancel::default(), Arc::new(Silent)).unwrap();
        let stage = engine.stage("test", 0);
        job(&stage);
        stage.finish();
    }

    #[test]
    fn results_come_in_order_and_failures_end_it() {
        let items: Vec<u64> = (0..103).collect();
        for threads in [1, 3] {
            with_threads(threads, |stage| {
                let mut taken = Vec::new();
                let square = |(): &mut (), &n: &u64| Ok(n * n);
                let take = |&n: &u64, square: u64| {
                    taken.push((n, square));
                    Ok(())
                };
                run_in_order(stage, (&items, 10), &Workers::none(), square, take).unwrap();
                assert!(taken.into_iter().eq(items.iter().map(|&n| (n, n * n))));
                let no_more = |(): &mut (), &n: &u64| if n < 57 { Ok(n) } else { Err(Error::failed("no more")) };
                let mut last = 0;
                let keep = |_: &u64, n: u64| {
                    last = n;
                    Ok(())
                };
                assert!(run_in_order(stage, (&items, 10), &Workers::none(), no_more, keep).is_err());
                assert!(last == 49);
                let full = |_: &u64, n: u64| if n < 33 { Ok(()) } else { Err(Error::failed("full")) };
                assert!(run_in_order(stage, (&items, 10), &Workers::none(), square, |n, _| full(n, *n)).is_err());
                run_in_order(stage, (&[], 10), &Workers::none(), square, |_: &u64, _| Ok(())).unwrap();
            });
        }
    }
}
