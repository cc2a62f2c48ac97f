//! How one tile is computed: pure functions, arrays in, arrays out. No threads, no files, no printing.

/// Calls a function with its variables, compiled for each vector unit and chosen by what the processor has.
///
/// The function must be `#[inline(always)]`. A call object is needed because a closure cannot be forced inline, and
/// what is not inlined is compiled for the smallest processor. Rust never fuses or reorders floating point
/// operations by itself, so all versions give the same bits.
macro_rules! vectorised {
    ({ $($name:ident : $type:ty),* $(,)? } => $function:ident) => {
        vectorised!({ $($name : $type),* } => $function -> ())
    };
    ({ $($name:ident : $type:ty),* $(,)? } => $function:ident -> $result:ty) => {{
        #[allow(clippy::elidable_lifetime_names)]
        struct Call<F>(F);
        trait Run { type Out; fn run(self) -> Self::Out; }
        impl<F: Run> pulp::NullaryFnOnce for Call<F> {
            type Output = F::Out;
            #[inline(always)]
            fn call(self) -> F::Out { self.0.run() }
        }
        struct Arguments<T>(T);
        impl Run for Arguments<($($type,)*)> {
            type Out = $result;
            #[inline(always)]
            fn run(self) -> $result {
                let ($($name,)*) = self.0;
                $function($($name),*)
            }
        }
        pulp::Arch::new().dispatch(Call(Arguments(($($name,)*))))
    }};
}

pub mod distance;
pub mod geometry;
pub mod image;
pub mod level_set;
pub mod outline;
pub mod points;
pub mod surface;
pub mod topology;
