//! What the builders of surfaces that move have in common.

/// The functions of a builder that say how the surface moves; `$motion` is where it keeps that.
macro_rules! motion_setters {
    ($($motion:ident).+) => {
        /// Weight of the curvature, a length: more is smoother.
        pub fn delta(mut self, delta: f64) -> Self {
            self.$($motion).+.delta = Some(delta);
            self
        }

        /// Time step.
        pub fn tau(mut self, tau: f64) -> Self {
            self.$($motion).+.tau = Some(tau);
            self
        }

        /// Regularisation of gradient norms, one over a length.
        pub fn epsilon(mut self, epsilon: f64) -> Self {
            self.$($motion).+.epsilon = Some(epsilon);
            self
        }

        /// Over-relaxation of the linear solver, between 0 and 2.
        pub fn omega(mut self, omega: f64) -> Self {
            self.$($motion).+.omega = omega;
            self
        }

        /// When the surface counts as at rest.
        pub fn stop(mut self, stop: $crate::pipeline::level_set::time_loop::Stop) -> Self {
            self.$($motion).+.stop = stop;
            self
        }

        /// Time steps at most.
        pub fn max_steps(mut self, steps: u32) -> Self {
            self.$($motion).+.max_steps = steps;
            self
        }
    };
}

pub(super) use motion_setters;
