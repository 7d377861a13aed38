//! `meniscus render`: pictures of a recording or of a live run.

use super::args::{FrameRange, ImageSize, Overrides, finite, positive, time};
use super::claim;
use super::console::Console;
use super::cost::{Cost, Stopwatch};
use super::failure::{Classify as _, Failure};
use super::format;
use super::frames::{FrameError, Frames};
use super::input::Input;
use super::interrupt::Interrupt;
use super::live;
use super::memory;
use super::picture::{Extras, PictureFormat, PictureKind, Pictures};
use super::progressive::{self, Goal, Passes};
use super::resume::Subject;
use clap::Args;
use meniscus_render_cpu::{Whitted, camera};
use meniscus_sim::Frame;
use meniscus_sim::knobs::Turned;
use meniscus_sim::render::{Image, RenderError, RenderReport, Renderer, View};
use serde::Serialize;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What `meniscus help render` says first.
pub(super) const ABOUT: &str = "Draw frames of a recording, or of a scene that is run live.\n\nThe extension of the output says what is \
    written: .png (tone-mapped) and .exr (linear radiance) hold one picture, .gif, .apng and .mp4 an animation at the \
    recording's frame rate (MP4 needs the program `ffmpeg`). Without --at and --frames, a still shows the last frame \
    (of a scene: the one at its `duration`) and an animation all frames. With --frames, PNG and EXR files get the \
    frame's number: `wave.png` becomes `wave_000012.png`. Ctrl-C gives up the picture that is being drawn and keeps \
    the finished ones; of an EXR that is drawn in passes it keeps the finished passes.";

/// Arguments of `meniscus render`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:\n  \
        meniscus render run.mrec --at 1.5 -o wave.png\n  \
        meniscus render run.mrec --frames 0..40 --size 640x360 --spp 2 -o wave.gif\n  \
        meniscus render run.mrec --at 1.5 --renderer path --noise 0.02 --time-limit 60 -o truth.exr\n  \
        meniscus render run.mrec --at 1.5 --renderer path --noise 0.01 --resume -o truth.exr\n  \
        meniscus render data/scenes/ripple-tank.toml --set water.level=0.1 -o tank.exr")]
pub struct RenderArgs {
    /// Recording, or scene to run live up to the frames asked for (a name that ends in .toml)
    #[arg(value_name = "RUN.mrec|SCENE.toml")]
    pub input: PathBuf,
    /// Changes to the keys of the scene
    #[command(flatten)]
    pub overrides: Overrides,
    /// Draw the frame nearest to this time in seconds
    #[arg(long, value_name = "T", value_parser = time, allow_negative_numbers = true, conflicts_with = "frames")]
    pub at: Option<f64>,
    /// Draw these frames: 12, 10..20 (20 left out), 10..=20, 10.. or ..20
    #[arg(long, value_name = "A..B")]
    pub frames: Option<FrameRange>,
    /// Renderer; `meniscus renderers` lists them
    #[arg(long, value_name = "NAME", default_value = live::DEFAULT_RENDERER)]
    pub renderer: String,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720")]
    pub size: ImageSize,
    /// Camera of the scene, or `auto` [default: the scene's first, else one that sees the whole domain]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Samples a pixel
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub spp: u32,
    /// Draw passes of --spp samples until the noise is at most this share of the picture's mean (renderers with noise)
    #[arg(long, value_name = "SHARE", value_parser = positive)]
    pub noise: Option<f64>,
    /// Draw passes of --spp samples for so many seconds a picture (renderers with noise)
    #[arg(long, value_name = "S", value_parser = positive)]
    pub time_limit: Option<f64>,
    /// Draw so many passes of --spp samples (renderers with noise)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub passes: Option<u32>,
    /// Draw on from the passes that the EXR file holds, if it is there
    #[arg(long)]
    pub resume: bool,
    /// Also write what the middle ray of each pixel met into the EXR file: hit, normal, Fresnel's share, refracted and reflected hit
    #[arg(long)]
    pub auxiliary: bool,
    /// Play an animation this many times faster than the water moves
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = positive)]
    pub speed: f64,
    /// Exposure in stops; EXR leaves it out [default: the camera's]
    #[arg(long, value_name = "STOPS", value_parser = finite, allow_negative_numbers = true)]
    pub exposure: Option<f64>,
    /// Picture to write: .png, .exr, .gif, .apng or .mp4
    #[arg(short, long = "out", value_name = "OUT")]
    pub out: PathBuf,
    /// Print what was drawn as one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Fewest bytes that drawing and writing a pixel takes: its radiance and its place in the file's buffer.
const BYTES_A_PIXEL: u64 = 12 + 3;

/// A picture that was drawn.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drawn {
    /// The file that it is in.
    pub file: PathBuf,
    /// Number of the frame.
    pub frame: u64,
    /// Time of the frame in seconds.
    pub time: f64,
}

/// A stage of drawing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stage {
    /// What was done.
    pub name: &'static str,
    /// Wall seconds, or those of the graphics adapter where it tells.
    pub seconds: f64,
}

/// What drawing gave and cost.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rendered {
    /// What was drawn.
    pub input: PathBuf,
    /// Name of the renderer.
    pub renderer: &'static str,
    /// The graphics adapter that drew, where one did.
    pub device: Option<String>,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples a pixel; of the last picture where their number was left open.
    pub samples: u32,
    /// Estimated noise of the last picture relative to its mean, where its samples were left open.
    pub noise: Option<f64>,
    /// The pictures, in order.
    pub pictures: Vec<Drawn>,
    /// Numbers of damaged frames that were left out.
    pub skipped: Vec<u64>,
    /// Rays cast.
    pub rays: u64,
    /// Seconds of each stage of all pictures together, in order: reading (or running) frames, the renderer's own, writing.
    pub stages: Vec<Stage>,
    /// Processor and wall seconds, a live run included.
    #[serde(flatten)]
    pub cost: Cost,
}

pub(super) fn run(args: &RenderArgs, console: &Console) -> Result<(), Failure> {
    let rendered = draw(args, console, Interrupt::install()?)?;
    if args.json {
        console.json(&rendered)
    } else {
        console.result(rendered.text())
    }
}

/// Draws what `args` ask for, and prints nothing but progress.
///
/// # Errors
/// What `meniscus render` ends with.
pub(super) fn draw(args: &RenderArgs, console: &Console, interrupt: Interrupt) -> Result<Rendered, Failure> {
    draw_from(args, None, console, interrupt)
}

/// As [`draw`], from `place` instead of a camera of the scene.
///
/// # Errors
/// As [`draw`].
pub(crate) fn draw_from(
    args: &RenderArgs,
    seen: Option<(&View, &Turned)>,
    console: &Console,
    interrupt: Interrupt,
) -> Result<Rendered, Failure> {
    let kind = PictureKind::of(&args.out)?;
    let mut renderer = live::renderer(&args.renderer)?;
    claim::writable(&args.out)?;
    claim::differs(&args.out, &args.input)?;
    let input = Input::open(&args.input, &args.overrides.set, console)?;
    if let Some((_, turned)) = seen {
        renderer.turn(turned);
    }
    let mut job = Job::new(args, seen.map(|(view, _)| view), kind, input, renderer)?;
    job.draw(console, interrupt)
}

/// Everything that is settled before the first picture.
struct Job<'a> {
    args: &'a RenderArgs,
    frames: Frames,
    renderer: Box<dyn Renderer>,
    view: View,
    wanted: Range<u64>,
    format: PictureFormat,
    goal: Option<Goal>,
    /// What notes what rays met, where that is asked for.
    looker: Option<Whitted>,
}

impl<'a> Job<'a> {
    fn new(
        args: &'a RenderArgs,
        place: Option<&View>,
        kind: PictureKind,
        input: Input,
        renderer: Box<dyn Renderer>,
    ) -> Result<Self, Failure> {
        let frames = Frames::new(input, renderer.as_ref())
            .map_err(|failure| failure.in_scene(&args.input, &args.overrides.set))?;
        let scene = frames.scene();
        let camera = args.camera.as_deref();
        let size = args.size;
        let pixels = u64::from(size.0.x) * u64::from(size.0.y);
        memory::require(
            BYTES_A_PIXEL * pixels,
            &format!("an image of {size} pixels"),
            "choose a smaller --size",
        )?;
        let view = match place {
            Some(place) => View {
                size: args.size.0,
                samples: args.spp,
                ..place.clone()
            },
            None => camera::view(scene, camera, args.size.0, args.spp).or_input()?,
        };
        let exposure = match args.exposure {
            Some(stops) => stops as f32,
            None => camera::exposure(scene, camera).or_input()?,
        };
        let wanted = match (args.at, args.frames) {
            (Some(time), _) => {
                let index = frames.nearest(time)?;
                index..index + 1
            }
            (None, Some(range)) => frames.select(range)?,
            (None, None) if kind.is_animation() => frames.select(FrameRange::ALL)?,
            (None, None) => {
                let all = frames.select(FrameRange::ALL)?;
                all.end - 1..all.end
            }
        };
        let goal = Goal {
            noise: args.noise,
            limit: args.time_limit.map(Duration::from_secs_f64),
            passes: args.passes,
        };
        let goals = goal.noise.is_some() || goal.limit.is_some() || goal.passes.is_some();
        if args.resume && !goals {
            return Err(Failure::input(
                "--resume draws on in passes: say until when with --passes, --noise or --time-limit",
            ));
        }
        if (args.resume || args.auxiliary) && kind != PictureKind::Exr {
            let option = if args.resume { "--resume" } else { "--auxiliary" };
            return Err(Failure::input(format_args!(
                "{option}: only .exr files hold what it needs; choose such a name with -o"
            )));
        }
        let goal = goals.then_some(goal);
        if goal.is_some() && !renderer.is_random() {
            return Err(Failure::input(format_args!(
                "renderer `{}` has no noise that passes would lessen; leave out --noise, --time-limit and --passes, \
                 or choose --renderer path",
                renderer.name()
            )));
        }
        let format = PictureFormat {
            kind,
            size: args.size.0,
            rate: scene.description.recording.rate * args.speed,
            count: wanted.end - wanted.start,
            exposure,
        };
        Ok(Self {
            args,
            frames,
            renderer,
            view,
            wanted,
            format,
            goal,
            looker: args.auxiliary.then(Whitted::default),
        })
    }

    fn draw(&mut self, console: &Console, interrupt: Interrupt) -> Result<Rendered, Failure> {
        let missing = self.renderer.needs(self.frames.scene()) - self.frames.channels();
        if !missing.is_empty() {
            console.detail(format!(
                "without the channels that renderer `{}` can use: {missing}",
                self.renderer.name()
            ));
        }
        let mut pictures = Pictures::create(&self.args.out, self.format, self.args.frames.is_some())?;
        let stopwatch = Stopwatch::start();
        let mut rendered = Rendered {
            input: self.args.input.clone(),
            renderer: self.renderer.name(),
            device: None,
            size: self.view.size.to_array(),
            samples: self.view.samples,
            noise: None,
            pictures: Vec::new(),
            skipped: Vec::new(),
            rays: 0,
            stages: Vec::new(),
            cost: stopwatch.cost(),
        };
        let outcome = self.draw_all(&mut pictures, &mut rendered, console, interrupt);
        // Also after a failure: an animation holds what was drawn by then.
        let finished = pictures.finish();
        outcome?;
        finished?;
        if rendered.pictures.is_empty() {
            return Err(Failure::input(format_args!(
                "{}: every frame asked for is damaged; choose others with --frames",
                self.args.input.display()
            )));
        }
        rendered.cost = stopwatch.cost();
        Ok(rendered)
    }

    fn draw_all(
        &mut self,
        pictures: &mut Pictures,
        rendered: &mut Rendered,
        console: &Console,
        interrupt: Interrupt,
    ) -> Result<(), Failure> {
        let args = self.args;
        let mut frame = Frame::new(self.frames.scene().grid);
        let mut image = Image::new(self.view.size);
        let total = self.wanted.end - self.wanted.start;
        let mut running = match &self.frames {
            Frames::Live { .. } => Some(console.progress("simulating", self.wanted.start + 1, "frame")),
            Frames::Recorded(_) => None,
        };
        let mut drawing = None;
        for index in self.wanted.clone() {
            let stopped = || Failure::Interrupted(kept(rendered.pictures.len(), total, &args.out));
            let stepped = |done| {
                if let Some(running) = &running {
                    running.set(done as f64);
                }
            };
            let reading = Instant::now();
            let read = self.frames.read(index, &mut frame, interrupt, stepped);
            let read_seconds = reading.elapsed().as_secs_f64();
            match read {
                Ok(true) => {}
                Ok(false) => return Err(stopped()),
                Err(FrameError::Damaged(what)) if total > 1 => {
                    console.warn(format!("left out: {what}"));
                    rendered.skipped.push(index);
                    continue;
                }
                Err(FrameError::Damaged(what)) => return Err(Failure::input(what)),
                Err(FrameError::Failed(failure)) => return Err(failure),
            }
            drop(running.take());
            let progress = drawing.get_or_insert_with(|| console.progress("rendering", total, "picture"));
            let done = (index - self.wanted.start) as f64;
            let advance = |share: f32| {
                progress.set(done + f64::from(share));
                !interrupt.pressed()
            };
            let path = pictures.file(index);
            let picture = match self.picture(&frame, &mut image, &path, &advance) {
                Err(Failure::Interrupted(_)) => return Err(stopped()),
                other => other?,
            };
            let report = picture.report;
            if let Some(samples) = picture.samples {
                (rendered.samples, rendered.noise) = (samples, picture.noise);
            }
            let writing = Instant::now();
            let file = pictures.write(&image, index, &picture.extras)?;
            let written_seconds = writing.elapsed().as_secs_f64();
            if picture.interrupted {
                return Err(Failure::Interrupted(format!(
                    "{} holds {} a pixel; --resume draws on",
                    file.display(),
                    format::count(u64::from(rendered.samples), "sample")
                )));
            }
            rendered.rays += report.rays;
            rendered.device = report.device;
            let stages = [("read", read_seconds)]
                .into_iter()
                .chain(report.stages)
                .chain([("written", written_seconds)]);
            for (stage, seconds) in stages {
                rendered.add(stage, seconds);
                console.detail(format!(
                    "frame {index}: {stage} took {}",
                    format::seconds(seconds)
                ));
            }
            rendered.pictures.push(Drawn {
                file,
                frame: index,
                time: frame.time,
            });
        }
        Ok(())
    }
}

/// A picture as it was drawn.
struct Picture {
    report: RenderReport,
    extras: Extras,
    /// Samples a pixel and noise, where their number was left open.
    samples: Option<u32>,
    noise: Option<f64>,
    /// Whether it is that of the passes before Ctrl-C.
    interrupted: bool,
}

impl Job<'_> {
    /// Draws the frame into `image`, which will be in `path`.
    fn picture(
        &mut self,
        frame: &Frame,
        image: &mut Image,
        path: &Path,
        advance: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<Picture, Failure> {
        let failed = |error| match error {
            RenderError::Interrupted => Failure::Interrupted(String::new()),
            other => Failure::Run(other.into()),
        };
        let (scene, view) = (self.frames.scene(), &self.view);
        let renderer = self.renderer.as_mut();
        let mut extras = Extras::default();
        if let Some(looker) = &mut self.looker {
            // A small part of the work, which the progress does not show.
            let look = |_: f32| advance(0.0);
            let seen = looker.render_aux(scene, frame, view, &look).map_err(failed)?;
            extras.planes = seen.planes();
        }
        let Some(goal) = self.goal else {
            let report = renderer
                .render(scene, frame, view, image, advance)
                .map_err(failed)?;
            return Ok(Picture {
                report,
                extras,
                samples: None,
                noise: None,
                interrupted: false,
            });
        };
        let subject = Subject::new(scene, frame, view, renderer.name());
        let kept = if self.args.resume {
            subject.resume(path)?
        } else {
            None
        };
        let mut passes: Passes = kept.unwrap_or_default();
        let subjects = (scene, frame, view);
        let (report, reached) =
            progressive::draw(renderer, subjects, goal, &mut passes, image, advance).map_err(failed)?;
        if self.format.kind == PictureKind::Exr {
            extras = Extras {
                planes: extras.planes,
                ..subject.keep(&passes)
            };
        } else if reached.interrupted {
            return Err(Failure::Interrupted(String::new()));
        }
        Ok(Picture {
            report,
            extras,
            samples: Some(reached.samples),
            noise: reached.noise,
            interrupted: reached.interrupted,
        })
    }
}

/// What remains after Ctrl-C.
fn kept(written: usize, total: u64, out: &Path) -> String {
    match written {
        0 => "no picture was finished".to_owned(),
        _ => format!(
            "{written} of {} finished, the last in {}",
            format::count(total, "picture"),
            out.display()
        ),
    }
}

impl Rendered {
    fn add(&mut self, name: &'static str, seconds: f64) {
        match self.stages.iter_mut().find(|stage| stage.name == name) {
            Some(stage) => stage.seconds += seconds,
            None => self.stages.push(Stage { name, seconds }),
        }
    }

    /// For people.
    pub fn text(&self) -> String {
        let [width, height] = self.size;
        let frame = |drawn: &Drawn| format!("frame {} at {:.3} s", drawn.frame, drawn.time);
        let what = match self.pictures.as_slice() {
            [] => return "no picture".to_owned(),
            [only] => format!("{}: {}", only.file.display(), frame(only)),
            [first, .., last] => {
                let count = self.pictures.len();
                let files = if first.file == last.file {
                    first.file.display().to_string()
                } else {
                    format!("{} to {}", first.file.display(), last.file.display())
                };
                format!("{files}: {count} frames, {} to {}", frame(first), frame(last))
            }
        };
        format!(
            "{what}; {width} x {height} pixels, {} a pixel{}, renderer {}{}; {}",
            format::count(u64::from(self.samples), "sample"),
            self.noise.map_or_else(String::new, |noise| format!(
                ", noise {}",
                format::three_digits(noise)
            )),
            self.renderer,
            self.device
                .as_ref()
                .map_or_else(String::new, |device| format!(" on {device}")),
            self.cost.text()
        )
    }
}
