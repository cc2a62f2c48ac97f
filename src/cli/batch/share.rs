//! Who runs next, with how much: the longest first, with one thread each while there are many, within the memory and the threads
//! of all. Pure arithmetic.

use super::plan::Plan;

/// An item that waits to be run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting {
    /// Which one.
    pub(crate) place: usize,
    pub(crate) plan: Plan,
    /// Bytes that it is to have, where its list says so.
    pub(crate) memory: Option<u64>,
    /// Threads that it is to have.
    pub(crate) threads: Option<usize>,
}

/// What there is, and what of it is free.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Free {
    pub(crate) memory: u64,
    pub(crate) all_memory: u64,
    pub(crate) threads: usize,
    pub(crate) all_threads: usize,
}

/// The place in `waiting` of the item that is to be started now, with its memory and threads; none where nothing fits what is
/// free. `waiting` is in the order in which it is to be run.
pub(crate) fn next(waiting: &[Waiting], free: &Free) -> Option<(usize, u64, usize)> {
    if free.threads == 0 {
        return None;
    }
    let seconds: f64 = waiting.iter().map(|one| one.plan.seconds).sum();
    waiting.iter().enumerate().find_map(|(at, one)| {
        let (memory, threads) = share(one, waiting.len(), seconds, free)?;
        Some((at, memory, threads))
    })
}

/// Memory and threads of one of so many that wait, which take `seconds` together with one thread; none where it does not fit.
fn share(one: &Waiting, many: usize, seconds: f64, free: &Free) -> Option<(u64, usize)> {
    let least = one.plan.least.max(1);
    // More threads than one where there are fewer items than threads, or where the item alone would take longer than its share of all.
    let of_few = free.threads / many.max(1);
    let of_long = (one.plan.seconds * free.all_threads as f64 / seconds.max(1e-9)).ceil() as usize;
    let wanted = one.threads.unwrap_or(of_few.max(of_long)).clamp(1, free.threads);
    let slot = free.all_memory / free.all_threads as u64;
    let memory = one.memory.unwrap_or((slot * wanted as u64).max(2 * least)).min(free.all_memory);
    let memory = match one.memory {
        Some(_) if memory > free.memory => return None,
        Some(_) => memory,
        None => memory.min(free.memory),
    };
    if memory < least {
        return None;
    }
    // Every thread takes memory of its own, and no more than the first did with all else.
    let threads = if one.threads.is_some() { wanted } else { wanted.min((memory / least) as usize).max(1) };
    Some((memory, threads))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIB: u64 = 1 << 20;

    fn waiting(place: usize, least: u64, seconds: f64) -> Waiting {
        Waiting { place, plan: Plan { least: least * MIB, disk: 0, seconds }, memory: None, threads: None }
    }

    fn free(memory: u64, threads: usize) -> Free {
        Free { memory: memory * MIB, all_memory: 800 * MIB, threads, all_threads: 4 }
    }

    #[test]
    fn many_get_a_thread_each_and_the_last_ones_more() {
        let many: Vec<Waiting> = (0..10).map(|n| waiting(n, 120, 1.0)).collect();
        assert_eq!(next(&many, &free(800, 4)), Some((0, 240 * MIB, 1)));
        assert_eq!(next(&many[..2], &free(800, 4)), Some((0, 400 * MIB, 2)));
        assert_eq!(next(&many[..1], &free(800, 4)), Some((0, 800 * MIB, 4)));
        assert_eq!(next(&many[..1], &free(300, 3)), Some((0, 300 * MIB, 2)), "as many threads as the memory holds");
        assert_eq!(next(&many, &free(800, 0)), None);
    }

    #[test]
    fn one_that_is_longer_than_all_others_gets_more() {
        let mut some: Vec<Waiting> = (0..5).map(|n| waiting(n, 112, 1.0)).collect();
        some.insert(0, waiting(9, 112, 15.0));
        assert_eq!(next(&some, &free(800, 4)).unwrap().2, 3);
    }

    #[test]
    fn what_does_not_fit_waits_and_smaller_ones_go_first() {
        let some = [waiting(0, 600, 9.0), waiting(1, 112, 1.0)];
        assert_eq!(next(&some, &free(500, 2)).map(|(at, ..)| at), Some(1));
        assert_eq!(next(&some, &free(100, 2)), None);
    }

    /// Whatever items ask for, what runs at one time is within what there is, and all have run at the end.
    #[test]
    fn sums_are_kept() {
        let mut left: Vec<Waiting> = (0..40).map(|n| waiting(n, 112 + 37 * (n as u64 % 11), (n % 7) as f64)).collect();
        left[3].memory = Some(700 * MIB);
        left[4].threads = Some(9);
        let (mut now, mut running) = (free(800, 4), std::collections::VecDeque::new());
        while !left.is_empty() || !running.is_empty() {
            if let Some((at, memory, threads)) = next(&left, &now) {
                let one = left.remove(at);
                assert!(one.plan.least <= memory && memory <= now.memory && (1..=now.threads).contains(&threads));
                (now.memory, now.threads) = (now.memory - memory, now.threads - threads);
                running.push_back((memory, threads));
            } else {
                let (memory, threads) = running.pop_front().expect("what fits alone runs");
                (now.memory, now.threads) = (now.memory + memory, now.threads + threads);
            }
        }
    }
}
