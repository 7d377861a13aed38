//! Pictures, drawn by a thread of their own: one, or two of which it tells how far they are apart.
//!
//! The newest [`Order`] wins. An order of a view at rest is drawn until another one comes: renderers with noise go on
//! with passes, whose mean is shown as it gets better.

use super::display::Display;
use super::latest::Latest;
use super::{Moment, Wake, tile};
use crate::cli::progressive::Passes;
use eframe::wgpu;
use meniscus_render_cpu::metrics::{Summary, flip};
use meniscus_render_cpu::tonemap::{self, ToneMap};
use meniscus_render_gpu::GpuRenderer;
use meniscus_render_gpu::device::Gpu;
use meniscus_sim::Scene;
use meniscus_sim::glam::{UVec2, Vec3};
use meniscus_sim::knobs::Turned;
use meniscus_sim::render::{Image, RenderError, Renderer, View};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A renderer.
pub enum Made {
    /// One that hands out its pictures.
    Any(Box<dyn Renderer>),
    /// One that can leave them on its device.
    Resident(Box<GpuRenderer>),
}

impl Made {
    /// What all have in common.
    pub fn renderer(&mut self) -> &mut dyn Renderer {
        match self {
            Self::Any(renderer) => renderer.as_mut(),
            Self::Resident(renderer) => renderer.as_mut(),
        }
    }
}

/// Makes a renderer by name; one for graphics adapters on the device that is given, if one is.
pub type Make = fn(&str, Option<&Arc<Gpu>>) -> Result<Made, String>;

/// Passes after which a picture at rest is good enough.
const MOST_PASSES: u32 = 4096;

/// Least time between two pictures of a view at rest.
const SHOW_EVERY: Duration = Duration::from_millis(250);

/// One of the pictures of an order.
#[derive(Clone, Debug)]
pub struct Side {
    /// The scene of the frame.
    pub scene: Arc<Scene>,
    /// The frame.
    pub moment: Arc<Moment>,
    /// Name of the renderer.
    pub renderer: String,
    /// What of it was changed.
    pub turned: Turned,
}

/// What is to be drawn.
#[derive(Clone, Debug)]
pub struct Order {
    /// Number that its pictures come back with.
    pub number: u64,
    /// What is shown.
    pub left: Side,
    /// What it is compared with.
    pub right: Option<Side>,
    /// Whether that is the middle of the picture alone, drawn after the picture is shown.
    pub tile: bool,
    /// Whether their difference is asked for.
    pub difference: bool,
    /// From where, and how large.
    pub view: View,
    /// Exposure in stops.
    pub exposure: f32,
    /// Whether nothing moves: then it may take its time, and is given up for a newer order.
    pub at_rest: bool,
    /// Whether the picture is wanted here although it could stay on the device.
    pub read: bool,
}

impl Order {
    /// What is drawn of the first or the second picture.
    fn view_of(&self, second: bool) -> View {
        if second && self.tile {
            tile::view(&self.view)
        } else {
            self.view.clone()
        }
    }
}

/// A picture as it is shown.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels.
    pub size: UVec2,
    /// sRGB, opaque, row-major from the top left; empty if it is on the device alone.
    pub pixels: Vec<[u8; 4]>,
    /// The same on the device that the window shares, where it never left it.
    pub texture: Option<wgpu::Texture>,
    /// Name of the renderer.
    pub renderer: &'static str,
    /// The graphics adapter that drew, where one did.
    pub device: Option<String>,
    /// Seconds that it took, of the clock.
    pub seconds: f64,
    /// Named stages with their seconds.
    pub stages: Vec<(&'static str, f64)>,
    /// Passes that its mean is of.
    pub passes: u32,
    /// Estimated noise relative to its mean, where it has some.
    pub noise: Option<f64>,
    /// Time of the frame, seconds.
    pub time: f64,
    /// Its number.
    pub frame: u64,
    /// Linear radiance, unless it is on the device alone.
    image: Option<Arc<Image>>,
}

/// How far two pictures are apart.
#[derive(Clone, Debug)]
pub struct Difference {
    /// FLIP as colours, sRGB.
    pub pixels: Vec<[u8; 4]>,
    /// FLIP over the pixels.
    pub flip: Summary,
    /// Seconds that comparing took.
    pub seconds: f64,
}

/// What came of an order.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// The order's.
    pub number: u64,
    /// Whether the order was of a view at rest.
    pub at_rest: bool,
    /// From where.
    pub view: View,
    /// Exposure in stops.
    pub exposure: f32,
    /// What is shown.
    pub left: Picture,
    /// What it is compared with.
    pub right: Option<Picture>,
    /// Their difference, where it was asked for.
    pub difference: Option<Difference>,
}

/// Why an order could not be drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Undrawn {
    /// The order's.
    pub number: u64,
    /// The renderer that failed.
    pub renderer: String,
    /// What happened, and what to do.
    pub message: String,
}

/// See the module.
#[derive(Debug)]
pub struct Drawing {
    orders: Arc<Latest<Order>>,
    drawn: Arc<Latest<Result<Drawn, Undrawn>>>,
    thread: Option<JoinHandle<()>>,
}

impl Drawing {
    /// Starts the thread. With `shared`, the device of the window, single pictures stay there.
    ///
    /// # Errors
    /// A message if it cannot be started.
    pub fn new(make: Make, shared: Option<Arc<Gpu>>, wake: Wake) -> Result<Self, String> {
        let orders = Arc::new(Latest::default());
        let drawn = Arc::new(Latest::default());
        let worker = Worker {
            make,
            wake,
            orders: Arc::clone(&orders),
            drawn: Arc::clone(&drawn),
            renderers: HashMap::new(),
            display: shared.map(Display::new),
        };
        let thread = std::thread::Builder::new()
            .name("meniscus-draw".to_owned())
            .spawn(move || worker.run())
            .map_err(|error| format!("cannot start a thread that draws: {error}"))?;
        Ok(Self {
            orders,
            drawn,
            thread: Some(thread),
        })
    }

    /// Asks for a picture; one that was asked for and not begun is forgotten.
    pub fn order(&self, order: Order) {
        drop(self.orders.put(order));
    }

    /// The newest picture, if there is one since the last call.
    pub fn take(&self) -> Option<Result<Drawn, Undrawn>> {
        self.drawn.take()
    }
}

impl Drop for Drawing {
    /// Waits for the picture in hand, which is given up.
    fn drop(&mut self) {
        self.orders.close();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Worker {
    make: Make,
    wake: Wake,
    orders: Arc<Latest<Order>>,
    drawn: Arc<Latest<Result<Drawn, Undrawn>>>,
    renderers: HashMap<String, Made>,
    display: Option<Display>,
}

/// A picture on its way: the mean over the passes drawn so far.
struct Refined {
    passes: Passes,
    random: bool,
    picture: Picture,
}

impl Worker {
    fn run(mut self) {
        while let Some(order) = self.orders.wait() {
            let outcome = self.draw(&order);
            if let Err(undrawn) = outcome {
                self.show(Err(undrawn));
            }
        }
    }

    fn show(&self, outcome: Result<Drawn, Undrawn>) {
        drop(self.drawn.put(outcome));
        (self.wake)();
    }

    /// Whether the order in hand is to be given up.
    fn overtaken(orders: &Latest<Order>, at_rest: bool) -> bool {
        orders.is_closed() || at_rest && orders.is_full()
    }

    /// Draws an order, at rest pass by pass until it is overtaken.
    fn draw(&mut self, order: &Order) -> Result<(), Undrawn> {
        let sides = std::iter::once(&order.left).chain(&order.right);
        let mut refined: Vec<Refined> = Vec::new();
        for side in sides {
            if order.tile && !refined.is_empty() {
                self.show(Ok(finish(order, &refined)));
            }
            match self.pass(order, side, None, !refined.is_empty())? {
                Some(first) => refined.push(first),
                None => return Ok(()),
            }
        }
        self.show(Ok(finish(order, &refined)));
        let mut shown = Instant::now();
        while order.at_rest && refined.iter().any(Refined::goes_on) {
            let sides = std::iter::once(&order.left).chain(&order.right);
            let mut next = Vec::new();
            for (side, before) in sides.zip(refined) {
                if !before.goes_on() {
                    next.push(before);
                    continue;
                }
                match self.pass(order, side, Some(before), !next.is_empty())? {
                    Some(more) => next.push(more),
                    None => return Ok(()),
                }
            }
            refined = next;
            if shown.elapsed() >= SHOW_EVERY || !refined.iter().any(Refined::goes_on) {
                self.show(Ok(finish(order, &refined)));
                shown = Instant::now();
            }
        }
        Ok(())
    }

    /// Draws one pass of one side onto those before it; `None` if it was overtaken.
    fn pass(
        &mut self,
        order: &Order,
        side: &Side,
        before: Option<Refined>,
        second: bool,
    ) -> Result<Option<Refined>, Undrawn> {
        let undrawn = |message: String| Undrawn {
            number: order.number,
            renderer: side.renderer.clone(),
            message,
        };
        if !self.renderers.contains_key(&side.renderer) {
            let made =
                (self.make)(&side.renderer, self.display.as_ref().map(Display::gpu)).map_err(undrawn)?;
            self.renderers.insert(side.renderer.clone(), made);
        }
        let Some(made) = self.renderers.get_mut(&side.renderer) else {
            return Ok(None);
        };
        let (mut passes, seconds_before) = match before {
            Some(before) => (before.passes, before.picture.seconds),
            None => (Passes::default(), 0.0),
        };
        let view = View {
            pass: passes.count(),
            ..order.view_of(second)
        };
        made.renderer().turn(&side.turned);
        let orders = &self.orders;
        let go_on = |_: f32| !Self::overtaken(orders, order.at_rest);
        let start = Instant::now();
        let (scene, frame) = (&*side.scene, &side.moment.frame);
        let display = self
            .display
            .as_ref()
            .filter(|_| order.right.is_none() && !order.read);
        let drawn = match (&mut *made, display) {
            (Made::Resident(renderer), Some(display)) => {
                let drawn = renderer.render_resident(scene, frame, &view, &go_on);
                drawn.map(|report| (report, show(renderer, display, order)))
            }
            (made, _) => {
                let mut image = Image::default();
                let drawn = made.renderer().render(scene, frame, &view, &mut image, &go_on);
                drawn.map(|report| (report, Shown::Here(image)))
            }
        };
        let seconds = start.elapsed().as_secs_f64();
        let renderer = made.renderer();
        let (report, shown) = match drawn {
            Ok((_, Shown::Elsewhere)) => {
                // The window's device is gone, and the renderer opened one of its own.
                self.display = None;
                return self.pass(order, side, None, second);
            }
            Ok(drawn) => drawn,
            Err(RenderError::Interrupted) => return Ok(None),
            Err(error) => {
                let name = renderer.name();
                // What it holds may be half of a scene, or a device that is gone.
                self.renderers.remove(&side.renderer);
                return Err(undrawn(format!("`{name}` cannot draw this: {error}")));
            }
        };
        let random = renderer.is_random();
        let (image, texture) = match shown {
            Shown::Here(mut image) => {
                if random && order.at_rest {
                    passes.add(&image);
                    passes.write(&mut image);
                }
                (Some(Arc::new(image)), None)
            }
            Shown::There(texture) => (None, Some(texture)),
            Shown::Elsewhere => (None, None),
        };
        let picture = Picture {
            size: view.size,
            pixels: Vec::new(),
            texture,
            renderer: renderer.name(),
            device: report.device,
            seconds: seconds_before + seconds,
            stages: report.stages,
            passes: passes.count().max(1),
            noise: passes.noise(),
            time: side.moment.frame.time,
            frame: side.moment.frame.index,
            image,
        };
        Ok(Some(Refined {
            passes,
            random,
            picture,
        }))
    }
}

impl Refined {
    fn goes_on(&self) -> bool {
        self.random && self.passes.count() < MOST_PASSES
    }
}

/// Where a picture is.
enum Shown {
    /// In memory.
    Here(Image),
    /// On the device of the window.
    There(wgpu::Texture),
    /// On another device, because that of the window was lost.
    Elsewhere,
}

/// Shows the picture that `renderer` drew, if it is on the display's device.
fn show(renderer: &GpuRenderer, display: &Display, order: &Order) -> Shown {
    match renderer.picture() {
        Some((gpu, picture)) if Arc::ptr_eq(gpu, display.gpu()) => {
            Shown::There(display.show(picture, order.view.size, &ToneMap::new(order.exposure)))
        }
        _ => Shown::Elsewhere,
    }
}

/// Tone-maps and compares what was drawn.
fn finish(order: &Order, refined: &[Refined]) -> Drawn {
    let map = ToneMap::new(order.exposure);
    let mapped = refined.iter().map(|refined| Picture {
        pixels: refined.picture.image.as_ref().map_or_else(Vec::new, |image| {
            let shown = |p: &Vec3| {
                let [r, g, b] = map.srgb8(*p);
                [r, g, b, 255]
            };
            image.pixels.par_iter().map(shown).collect()
        }),
        ..refined.picture.clone()
    });
    let mut mapped: Vec<Picture> = mapped.collect();
    let right = if mapped.len() > 1 { mapped.pop() } else { None };
    let difference = refined.get(1).filter(|_| order.difference).and_then(|second| {
        let start = Instant::now();
        let display = |image: &Image| -> Vec<Vec3> {
            image
                .pixels
                .par_iter()
                .map(|p| tonemap::srgb(map.display(*p)))
                .collect()
        };
        let second = second.picture.image.as_ref()?;
        let first = refined[0].picture.image.as_ref()?;
        let middle = (first.size != second.size).then(|| tile::cut(first, second.size));
        let first = middle.as_ref().unwrap_or(first);
        let values = flip::flip(
            first.size,
            &display(second),
            &display(first),
            flip::PIXELS_PER_DEGREE,
        )
        .ok()?;
        Some(Difference {
            flip: Summary::of(&values, None)?,
            pixels: values.par_iter().map(|v| heat(*v)).collect(),
            seconds: start.elapsed().as_secs_f64(),
        })
    });
    let left = mapped.swap_remove(0);
    Drawn {
        number: order.number,
        at_rest: order.at_rest,
        view: order.view.clone(),
        exposure: order.exposure,
        left,
        right,
        difference,
    }
}

impl Drawn {
    /// Writes the picture that is shown as a file, as `meniscus render` does.
    ///
    /// # Errors
    /// A message that says what cannot be written.
    pub fn save(&self, path: &std::path::Path) -> Result<(), String> {
        let map = ToneMap::new(self.exposure);
        let image = self
            .left
            .image
            .as_ref()
            .ok_or("the picture is on the device alone")?;
        meniscus_render_cpu::output::write_png(path, image, &map).map_err(|error| error.to_string())
    }

    /// Whether [`Self::save`] can write it.
    pub fn is_here(&self) -> bool {
        self.left.image.is_some()
    }
}

/// Colour of an error from 0 to 1: black over purple and orange to white, evenly brighter.
pub fn heat(value: f32) -> [u8; 4] {
    const STOPS: [[f32; 3]; 6] = [
        [0.0, 0.0, 4.0],
        [60.0, 15.0, 110.0],
        [140.0, 41.0, 129.0],
        [222.0, 73.0, 104.0],
        [254.0, 159.0, 109.0],
        [252.0, 253.0, 191.0],
    ];
    let at = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let k = (at as usize).min(STOPS.len() - 2);
    let mix = |c: usize| (STOPS[k][c] + (at - k as f32) * (STOPS[k + 1][c] - STOPS[k][c])) as u8;
    [mix(0), mix(1), mix(2), 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heat_grows_brighter() {
        let brightness = |v: f32| heat(v)[..3].iter().map(|c| u32::from(*c)).sum::<u32>();
        let mut before = 0;
        for k in 0..=20 {
            let now = brightness(k as f32 / 20.0);
            assert!(now >= before, "{k}");
            before = now;
        }
        assert_eq!(heat(f32::NAN.max(0.0)), heat(0.0));
        assert_eq!(heat(7.0), heat(1.0));
    }
}
