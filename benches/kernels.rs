//! Kernel speed in voxels per second, in cache, on one thread.
#![allow(missing_docs)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use strandline::kernel::level_set::covolume::{Fields, Planes, Velocity, assemble};
use strandline::kernel::level_set::mask::CellMask;
use strandline::kernel::level_set::scheme::SCHEME_LEN;
use strandline::kernel::level_set::{CELL_LEN, sor};

fn level_set(c: &mut Criterion) {
    let n = 18usize.pow(3);
    let u: Vec<f32> = (0..n).map(|i| 1.0 / (1.0 + (((i % 18) as f32) - 8.0 + (i / 324) as f32 * 0.1).exp())).collect();
    let d: Vec<f32> = (0..n).map(|i| ((i % 18) as f32 - 8.5).abs() + (i / 18 % 18) as f32 * 0.01).collect();
    let g: Vec<f32> = (0..n).map(|i| ((i * 7919) % 1000) as f32 / 1000.0).collect();
    let mut mask = CellMask::new();
    mask.set(&[1; CELL_LEN], [16; 3], [[false; 2]; 3]);
    let velocity = Velocity { theta: 1.0, rho: 0.5, delta: 0.1, epsilon: 0.01, tau: 1.0, normalised: true };
    let (mut work, mut scheme) = (Planes::new(), vec![0.0; SCHEME_LEN]);
    let mut group = c.benchmark_group("level_set");
    group.throughput(Throughput::Elements(CELL_LEN as u64));
    let fields = Fields { u: &u, d: &d, g: &g };
    group.bench_function("assemble", |b| {
        b.iter(|| assemble(fields, &mask, [1.0; 3], &velocity, &mut work, &mut scheme));
    });
    let by = sor::Relaxation { scheme: &scheme, mask: &mask, omega: 1.2, iterations: 4 };
    let (mut v, mut halves) = (u.clone(), sor::Halves::new());
    group.bench_function("relax4", |b| b.iter(|| sor::relax(&mut v, &mut halves, by)));
    group.finish();
}

criterion_group!(kernels, level_set);
criterion_main!(kernels);
