//! What was typed becomes what is meant: settings checked one by one and together, budgets resolved.

use std::path::Path;

use crate::cli::args::common::{
    Edge, ImageArg, MotionArgs, OverlapArg, ResourceArgs, SegmentArgs, SmoothingArg, StartArg, StopArg,
};
use crate::cli::args::reconstruct::ReconstructArgs;
use crate::cli::terminal::world;
use crate::error::{Error, Result};
use crate::job::resources::Resources;
use crate::pipeline::image::terms::Smoothing;
use crate::pipeline::level_set::motion::Motion;
use crate::pipeline::level_set::time_loop::Stop;
use crate::pipeline::limits::{ABOVE_ZERO, check, check_given};
use crate::pipeline::reconstruct::ReconstructSettings;
use crate::pipeline::segment::{ImageModel, Overlap, SegmentSettings, Start};

const L2_TOLERANCE: f64 = 1e-3;

/// The settings of a segmentation.
pub(crate) fn settings(args: &SegmentArgs) -> Result<SegmentSettings> {
    let defaults = SegmentSettings::default();
    let (image, pull) = (&args.picture, &args.pull);
    let edges = Motion {
        rho: pull.rho.unwrap_or(defaults.motion.rho),
        normalised: image.edge == Edge::Normalised,
        ..defaults.motion
    };
    let settings = SegmentSettings {
        method: args.distance.method,
        image: match image.model {
            ImageArg::Auto => ImageModel::Auto,
            ImageArg::Level => ImageModel::Level,
            ImageArg::Wall => ImageModel::Wall,
            ImageArg::Edge => ImageModel::Edge,
            ImageArg::None => ImageModel::None,
        },
        start: match image.start {
            StartArg::Auto => Start::Auto,
            StartArg::Flood => Start::Flood,
        },
        cross_validate: image.cross_validate,
        motion: motion(&args.motion, edges),
        theta: args.motion.theta,
        rho: pull.rho,
        k: pull.k.unwrap_or(defaults.k),
        smoothing: match image.smoothing {
            SmoothingArg::Gaussian => Smoothing::Gaussian,
            SmoothingArg::Heat => Smoothing::Heat,
        },
        sigma: pull.sigma,
        beta: args.motion.beta,
        caps: !image.no_caps,
        percentiles: image.percentiles,
        overlap: match image.overlap {
            OverlapArg::Smaller => Overlap::Smaller,
            OverlapArg::Larger => Overlap::Larger,
            OverlapArg::First => Overlap::First,
            OverlapArg::Last => Overlap::Last,
        },
        fill_gaps: image.fill_gaps,
        brick: args.resources.brick.unwrap_or(defaults.brick),
    };
    let settings = settings.together();
    settings.check()?;
    Ok(settings)
}

/// The settings of a reconstruction.
pub(crate) fn reconstruct_settings(args: &ReconstructArgs) -> Result<ReconstructSettings> {
    let defaults = ReconstructSettings::default();
    let settings = ReconstructSettings {
        method: args.distance.method,
        motion: motion(&args.motion, defaults.motion),
        beta: args.motion.beta,
        noise: args.points.noise,
        open: args.points.open,
        vertices: args.surface.vertices.map(Into::into),
        keeps_topology: args.surface.keep_topology,
        ..defaults
    };
    settings.check()?;
    Ok(settings)
}

/// How the surface is to move; what was not typed as in `defaults`.
fn motion(args: &MotionArgs, defaults: Motion) -> Motion {
    Motion {
        theta: args.theta.unwrap_or(defaults.theta),
        delta: args.delta,
        tau: args.tau,
        epsilon: args.epsilon,
        omega: args.omega.unwrap_or(defaults.omega),
        stop: stop(args, defaults.stop),
        max_steps: args.max_steps.unwrap_or(defaults.max_steps),
        ..defaults
    }
}

/// More ranks than this are no use in one process.
const MOST_RANKS: usize = 64;

/// Refuses numbers of ranks that are of no use.
pub(crate) fn check_ranks(ranks: usize) -> Result<()> {
    if (1..=MOST_RANKS).contains(&ranks) {
        return Ok(());
    }
    Err(Error::usage(format!("--ranks is {ranks}; give 1 to {MOST_RANKS}")))
}

/// A number above 0, or none.
pub(crate) fn above_zero(flag: &str, value: Option<f64>) -> Result<Option<f64>> {
    check_given(flag, value, ABOVE_ZERO)?;
    Ok(value)
}

fn stop(args: &MotionArgs, default: Stop) -> Stop {
    match (args.stop, default) {
        (StopArg::Surface, Stop::Surface(limit)) => Stop::Surface(args.tol.unwrap_or(limit)),
        (StopArg::Surface, Stop::L2(_)) => Stop::Surface(args.tol.unwrap_or(0.02)),
        (StopArg::L2, _) => Stop::L2(args.tol.unwrap_or(L2_TOLERANCE)),
    }
}

/// A spacing from the command line.
pub(crate) fn spacing(flag: &str, given: Option<[f64; 3]>) -> Result<Option<[f64; 3]>> {
    if let Some([x, y, z]) = given.filter(|h| h.iter().any(|&v| check("", v, ABOVE_ZERO).is_err())) {
        return Err(Error::usage(format!("{flag} is {x},{y},{z}; give lengths, each more than 0")));
    }
    Ok(given)
}

/// Memory, threads and scratch; `output` is what lies nearest to large free disks when nothing else is said.
pub(crate) fn resources(args: &ResourceArgs, output: Option<&Path>) -> Result<Resources> {
    Resources::new(args.memory, args.threads, args.scratch.as_deref(), output)
}

/// The same of one of several ranks, of which so many share this process; others may share the machine.
pub(crate) fn resources_of_rank(args: &ResourceArgs, output: Option<&Path>, in_process: usize) -> Result<Resources> {
    let gave = [args.memory.is_some(), args.threads.is_some()];
    Ok(resources(args, output)?.share(world::sharing(in_process), gave))
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::args::command_line::{Cli, Command};
    use crate::pipeline::distance::Method;
    use crate::pipeline::segment::FillGaps;

    fn typed(flags: &str) -> Box<SegmentArgs> {
        let words = "strandline segment image.tif --points marks.csv -o none".split(' ');
        let cli = Cli::try_parse_from(words.chain(flags.split_whitespace())).unwrap();
        let Command::Segment(args) = cli.command else { panic!("another command") };
        args
    }

    fn meant(flags: &str) -> Result<SegmentSettings> {
        let args = typed(flags);
        settings(&args)
    }

    #[test]
    fn nothing_typed_means_the_defaults() {
        assert_eq!(meant("").unwrap(), SegmentSettings::default());
    }

    #[test]
    fn the_help_states_the_true_defaults() {
        use clap::CommandFactory;
        let help = Cli::command().find_subcommand_mut("segment").unwrap().render_long_help().to_string();
        let defaults = SegmentSettings::default();
        for (value, what) in [
            (defaults.motion.theta, "towards the points"),
            (defaults.k, "intensities from 0 to 1"),
            (defaults.motion.omega, "between 0 and 2"),
            (f64::from(defaults.motion.max_steps), "Time steps at most"),
        ] {
            let line = help.lines().find(|line| line.contains(what)).unwrap_or_else(|| panic!("{what}: {help}"));
            assert!(line.contains(&format!("[default: {value}]")), "{line}");
        }
        assert!(help.contains("[default: 64;") && defaults.brick == 64);
        assert!(help.contains("[default: 0.1,99.9]") && defaults.percentiles == [0.1, 99.9]);
        assert!(help.contains("0.02 for surface") && defaults.motion.stop == Stop::Surface(0.02));
    }

    #[test]
    fn every_flag_arrives() {
        let settings = meant(
            "--delta 1 --theta 2 --rho 3 --k 4 --sigma 5 --beta 6 --tau 7 --epsilon 8 --omega 1.5 --stop l2 --tol 9 \
             --max-steps 10 --method fsm --edge plain --smoothing heat --percentiles 1,99 --no-caps --overlap last --image wall --cross-validate \
              --fill-gaps 2.5 --brick 32",
        );
        let expected = SegmentSettings {
            method: Method::FSM,
            // A beta is for the flood.
            image: ImageModel::Wall,
            start: Start::Flood,
            theta: Some(2.0),
            rho: Some(3.0),
            cross_validate: true,
            motion: Motion {
                theta: 2.0,
                rho: 3.0,
                normalised: false,
                delta: Some(1.0),
                tau: Some(7.0),
                epsilon: Some(8.0),
                omega: 1.5,
                stop: Stop::L2(9.0),
                max_steps: 10,
            },
            k: 4.0,
            smoothing: Smoothing::Heat,
            sigma: Some(5.0),
            beta: Some(6.0),
            caps: false,
            percentiles: [1.0, 99.0],
            overlap: Overlap::Last,
            fill_gaps: Some(FillGaps::Width(2.5)),
            brick: 32,
        };
        assert_eq!(settings.unwrap(), expected);
        assert_eq!(meant("--fill-gaps auto").unwrap().fill_gaps, Some(FillGaps::Auto));
        assert_eq!(meant("--stop l2").unwrap().motion.stop, Stop::L2(L2_TOLERANCE));
    }

    #[test]
    fn senseless_settings_are_refused_by_name() {
        for flags in [
            "--theta -1",
            "--theta nan",
            "--rho inf",
            "--delta -0.1",
            "--k -3",
            "--sigma -1",
            "--beta 0",
            "--tau 0",
            "--tau 1e300",
            "--epsilon 0",
            "--omega 2",
            "--omega 0",
            "--tol 0",
            "--fill-gaps 0",
            "--fill-gaps -2",
            "--fill-gaps nan",
            "--percentiles 99,1",
            "--percentiles -1,50",
            "--percentiles nan,50",
            "--percentiles 0,101",
            "--brick 8",
            "--brick 24",
            "--brick 0",
            "--brick -16",
            "--brick 528",
        ] {
            let error = meant(flags).unwrap_err();
            let flag = flags.split(' ').next().unwrap();
            assert!(error.exit_code() == 2 && error.to_string().starts_with(flag), "{flags}: {error}");
        }
        for given in [[0.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, f64::NAN], [f64::INFINITY, 1.0, 1.0]] {
            assert!(spacing("--image-spacing", Some(given)).unwrap_err().to_string().contains("--image-spacing"));
        }
    }
}
