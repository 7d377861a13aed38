//! Descriptions drawn at random.

use super::*;

/// Draws the parts of a description; every value is possible, few are likely.
pub(super) struct Draw(pub(super) Rng);

impl Draw {
    fn below(&mut self, end: u64) -> u64 {
        self.0.next_u64() % end
    }

    fn flip(&mut self) -> bool {
        self.below(2) == 0
    }

    /// Any single-precision number in a range, over all its magnitudes.
    fn number(&mut self, low: f32, high: f32) -> f32 {
        let v = match self.below(4) {
            0 => low,
            1 => high,
            2 => f32::from_bits(self.0.next_u64() as u32),
            _ => low + (high - low) * self.0.uniform_f32(),
        };
        if v >= low && v <= high {
            v
        } else {
            low + (high - low) * self.0.uniform_f32()
        }
    }

    fn any(&mut self) -> f32 {
        self.number(-1e9, 1e9)
    }

    fn length(&mut self) -> f32 {
        self.number(1e-6, 1e9)
    }

    fn wide(&mut self, low: f64, high: f64) -> f64 {
        let v = f64::from_bits(self.0.next_u64());
        if v >= low && v <= high {
            v
        } else {
            low + (high - low) * self.0.uniform()
        }
    }

    fn vec2(&mut self) -> Vec2 {
        Vec2::new(self.any(), self.any())
    }

    fn vec3(&mut self) -> Vec3 {
        Vec3::new(self.any(), self.any(), self.any())
    }

    fn color(&mut self) -> Vec3 {
        Vec3::new(
            self.number(0.0, 1.0),
            self.number(0.0, 1.0),
            self.number(0.0, 1.0),
        )
    }

    fn radiance(&mut self) -> Vec3 {
        Vec3::new(
            self.number(0.0, 1e9),
            self.number(0.0, 1e9),
            self.number(0.0, 1e9),
        )
    }

    fn turn(&mut self) -> Quat {
        let q = Quat::from_xyzw(
            self.number(-1.0, 1.0),
            0.5,
            self.number(-1.0, 1.0),
            self.number(-1.0, 1.0),
        );
        q.normalize()
    }

    fn option<T>(&mut self, f: impl FnOnce(&mut Self) -> T) -> Option<T> {
        if self.flip() { Some(f(self)) } else { None }
    }

    fn list<T>(&mut self, f: impl Fn(&mut Self, usize) -> T) -> Vec<T> {
        (0..self.below(4) as usize).map(|k| f(self, k)).collect()
    }

    /// A text with what texts may hold.
    fn text(&mut self, k: usize) -> String {
        let odd = [
            "",
            " \"quoted\" ",
            "\\",
            "é漢😀",
            "\n",
            "'",
            "#",
            "\t",
            "\u{7f}",
            "\u{1}",
        ];
        format!(
            "t{k}{}{}",
            odd[self.below(10) as usize],
            odd[self.below(10) as usize]
        )
    }

    fn file(&mut self) -> PathBuf {
        PathBuf::from(self.text(0))
    }

    pub(super) fn description(&mut self) -> Description {
        Description {
            name: self.text(0),
            seed: if self.flip() {
                self.0.next_u64()
            } else {
                self.below(9)
            },
            duration: self.wide(1e3, 1e9),
            domain: Domain {
                origin: self.option(Self::vec2),
                size: self.option(|d| Vec2::new(d.length(), d.length())),
            },
            water: Water {
                level: self.any(),
                initial: self.initial(),
                index: self.number(1.0, 4.0),
                absorption: self.radiance(),
                scattering: self.radiance(),
            },
            terrain: self.option(Self::terrain),
            ground: GroundLook {
                albedo: self.color(),
                steep_albedo: self.color(),
                shore_albedo: self.color(),
                checker: self.number(0.0, 1e9),
            },
            solver: self.solver(),
            beds: Vec::new(),
            boundary: self.boundary(),
            layers: self.list(|d, _| Layer {
                solver: d.solver(),
                fade_depth: d.number(0.0, 1e9),
            }),
            detail: self.option(Self::detail),
            objects: self.list(Self::object),
            light: Light {
                sun: Some(self.sun()),
                sky: self.sky(),
            },
            horizon: self.option(|d| Horizon {
                distance: d.option(Self::length),
                depth: d.option(Self::length),
                mix: d.option(|d| d.number(0.0, 1.0)),
                floor: d.number(0.0, 1e9),
                normals: [NormalBlend::Face, NormalBlend::Distance, NormalBlend::Area][d.below(3) as usize],
            }),
            cameras: self.list(|d, k| Camera {
                name: d.text(k),
                position: d.vec3(),
                target: Vec3::new(0.5, 0.25, 0.125),
                fov: d.number(0.1, 179.0),
                exposure: d.number(-30.0, 30.0),
            }),
            events: self.list(|d, _| d.event()),
            recording: Recording {
                rate: self.wide(1e-6, 1e-2),
                channels: self.option(|d| {
                    Channels::from_bits(d.below(64) as u32)
                        .unwrap()
                        .iter()
                        .map(|(n, _)| n.to_string())
                        .collect()
                }),
                tolerance: self.number(0.0, 1e6),
            },
        }
    }

    fn initial(&mut self) -> Initial {
        match self.below(4) {
            0 => Initial::Still,
            1 => {
                let min = Vec2::new(self.number(-1e6, 0.0), self.number(-1e6, 0.0));
                let size = Vec2::new(self.number(1.0, 1e6), self.number(1.0, 1e6));
                Initial::Dam {
                    min,
                    max: size,
                    level: self.any(),
                }
            }
            2 => Initial::Disturbance {
                position: self.vec2(),
                radius: self.length(),
                height: self.any(),
            },
            _ => Initial::Array { file: self.file() },
        }
    }

    fn terrain(&mut self) -> Terrain {
        let (scale, offset) = (self.wide(-1e9, 1e9), self.wide(-1e9, 1e9));
        let pixel_size = Vec2::new(self.length(), self.length());
        match self.below(5) {
            0 => Terrain::Flat { height: self.any() },
            1 => Terrain::Image {
                file: self.file(),
                pixel_size,
                scale,
                offset,
                crop: self.option(|d| [d.below(1 << 32) as u32, 0, 2 + d.below(9) as u32, u32::MAX]),
                origin: self.vec2(),
            },
            2 => Terrain::Npy {
                file: self.file(),
                pixel_size,
                scale,
                offset,
                origin: self.vec2(),
            },
            3 => Terrain::AsciiGrid {
                file: self.file(),
                scale,
                offset,
                nodata_height: self.option(|d| d.wide(-1e9, 1e9)),
                map_origin: self.option(|d| DVec2::new(d.wide(-1e9, 1e9), d.wide(-1e9, 1e9))),
            },
            _ => Terrain::Soundings {
                file: self.file(),
                coordinates: if self.flip() {
                    Coordinates::Metres
                } else {
                    Coordinates::LongitudeLatitude
                },
                spacing: self.length(),
                scale,
                offset,
                map_origin: self.option(|d| DVec2::new(d.wide(-1e9, 1e9), d.wide(-1e9, 1e9))),
            },
        }
    }

    fn solver(&mut self) -> Solver {
        let spacing = self.length();
        match self.below(5) {
            0 => Solver::WaveEquation(WaveEquation {
                spacing,
                scheme: if self.flip() {
                    WaveScheme::Explicit
                } else {
                    WaveScheme::Implicit
                },
                speed: self.option(|d| d.number(1e-6, 1e6)),
                depth: self.length(),
                damping: self.number(0.0, 1e9),
                step: self.option(Self::length),
            }),
            1 => Solver::Procedural(Procedural {
                spacing,
                depth: self.option(Self::length),
                waves: self.list(|d, _| Wave {
                    amplitude: d.number(0.0, 1.0),
                    wavelength: d.number(100.0, 1e6),
                    direction: d.number(-360.0, 360.0),
                    phase: d.number(-360.0, 360.0),
                    steepness: d.number(0.0, 1.0),
                }),
            }),
            2 => Solver::Ocean(Ocean {
                spacing,
                depth: self.option(|d| d.wide(1.0, 1e9)),
                capillary: self.flip(),
                choppiness: self.wide(0.0, 10.0),
                loop_period: self.option(|d| d.wide(0.1, 1e6)),
                seas: self.list(|d, _| d.sea()),
                cascades: self.list(|d, _| Cascade {
                    period: d.wide(1.0, 1e9),
                }),
                foam: self.option(|d| OceanFoam {
                    threshold: d.wide(-10.0, 1.0),
                    growth: d.wide(0.0, 1e3),
                    fade: d.wide(0.001, 1e3),
                }),
            }),
            3 => Solver::Sph(Sph {
                spacing,
                particle: self.option(Self::length),
                model: if self.flip() {
                    SphModel::Dfsph
                } else {
                    SphModel::Mcg03
                },
                vessel: if self.flip() { Vessel::Box } else { Vessel::Round },
                viscosity: self.number(0.0, 1e6),
                walls: if self.flip() {
                    SphWalls::Slip
                } else {
                    SphWalls::Stick
                },
                surface_tension: self.number(0.0, 1e3),
                stiffness: self.option(|d| d.number(1e-6, 1e9)),
                gravity: Vec3::new(self.number(-1e4, 1e4), self.number(-1e4, 1e4), 0.0),
                tilts: self.list(|d, k| Tilt {
                    time: k as f64,
                    gravity: Vec3::splat(d.number(-1e4, 1e4)),
                }),
                courant: self.option(|d| d.number(0.02, 0.99)),
                step: self.option(Self::length),
                most_steps: self.option(|d| d.number(1.0, 1e9)),
                surface: if self.flip() {
                    SphSurface::Fast
                } else {
                    SphSurface::Exact
                },
                droplets: if self.flip() {
                    SphDroplets::Clear
                } else {
                    SphDroplets::All
                },
                emitters: self.list(|d, _| Emitter {
                    position: Vec3::ONE,
                    velocity: Vec3::splat(d.number(-1e3, 1e3)),
                    radius: d.length(),
                    start: d.wide(0.0, 1e9),
                    end: None,
                }),
                drains: self.list(|d, _| Drain {
                    min: Vec3::ZERO,
                    max: Vec3::splat(d.length()),
                }),
            }),
            _ => Solver::ShallowWater(ShallowWater {
                spacing,
                scheme: if self.flip() {
                    ShallowWaterScheme::Auto
                } else {
                    ShallowWaterScheme::FiniteVolume
                },
                manning: self.number(0.0, 10.0),
                smagorinsky: self.number(0.0, 0.19),
                courant: self.option(|d| d.number(0.01, 0.99)),
                relaxation: None,
                film_depth: self.option(Self::length),
                splash: self.option(|d| Splash {
                    droplets: d.flip(),
                    foam: d.flip(),
                    slope: d.number(0.001, 100.0),
                    amount: d.number(0.0, 1.0),
                    droplet_radius: d.option(|d| d.number(1e-6, 1e4)),
                    foam_life: d.number(1e-6, 1e9),
                }),
            }),
        }
    }

    fn sea(&mut self) -> Sea {
        let (wind, height) = (self.wide(0.0, 100.0), self.wide(0.0, 100.0));
        let (fetch, gamma) = (self.wide(0.0, 1e9), self.wide(1.0, 20.0));
        Sea {
            spectrum: match self.below(5) {
                0 => Spectrum::Phillips { wind, height },
                1 => Spectrum::PiersonMoskowitz { wind },
                2 => Spectrum::Jonswap { wind, fetch, gamma },
                3 => Spectrum::Tma { wind, fetch, gamma },
                _ => Spectrum::Swell {
                    height,
                    period: self.wide(0.01, 1e3),
                    gamma,
                },
            },
            direction: self.wide(-360.0, 360.0),
            spreading: match self.below(5) {
                0 => Spreading::Hasselmann,
                1 => Spreading::Mitsuyasu,
                2 => Spreading::DonelanBanner,
                3 => Spreading::CosinePower {
                    exponent: self.wide(0.0, 1e4),
                },
                _ => Spreading::Swell {
                    elongation: self.wide(0.0, 10.0),
                },
            },
        }
    }

    fn detail(&mut self) -> Detail {
        let (period, lifetime) = (self.wide(1.0, 1e9), self.wide(0.01, 1e6));
        if self.flip() {
            Detail::Noise {
                period,
                height: self.wide(0.0, 1e9),
                rate: self.wide(0.0, 1e3),
                lifetime,
            }
        } else {
            Detail::Waves {
                period,
                wind: self.wide(0.0, 100.0),
                fetch: self.wide(0.0, 1e9),
                direction: self.wide(-360.0, 360.0),
                lifetime,
            }
        }
    }

    fn boundary(&mut self) -> Boundary {
        let mut pair = || match self.below(3) {
            0 => (Edge::Periodic, Edge::Periodic),
            1 => (Edge::Wall, Edge::Open),
            _ => (Edge::Open, Edge::Wall),
        };
        let ((x_min, x_max), (z_min, z_max)) = (pair(), pair());
        Boundary {
            drives: Vec::new(),
            x_min,
            x_max,
            z_min,
            z_max,
        }
    }

    fn object(&mut self, k: usize) -> Object {
        Object {
            name: format!("{k} {}", self.text(k)),
            shape: match self.below(4) {
                0 => Shape::Sphere {
                    radius: self.length(),
                },
                1 => Shape::Box {
                    size: Vec3::new(self.length(), self.length(), self.length()),
                },
                2 => Shape::Cylinder {
                    radius: self.length(),
                    height: self.length(),
                },
                _ => Shape::Model {
                    file: self.file(),
                    scale: self.length(),
                },
            },
            position: self.vec3(),
            rotation: self.turn(),
            velocity: glam::Vec3::ZERO,
            spin: glam::Vec3::ZERO,
            density: self.number(1e-3, 1e6),
            motion: match self.below(3) {
                0 => Motion::Fixed,
                1 => Motion::Free,
                _ => Motion::Path {
                    points: (0..1 + self.below(3))
                        .map(|n| WayPoint {
                            time: n as f64 + self.0.uniform() * 0.9,
                            position: self.vec3(),
                            rotation: self.turn(),
                        })
                        .collect(),
                },
            },
            color: self.option(Self::color),
        }
    }

    fn sun(&mut self) -> Sun {
        Sun {
            elevation: self.number(0.0, 90.0),
            azimuth: self.number(-360.0, 360.0),
            irradiance: self.radiance(),
            radius: self.number(1e-3, 45.0),
        }
    }

    fn sky(&mut self) -> Sky {
        match self.below(3) {
            0 => Sky::Uniform {
                radiance: self.radiance(),
            },
            1 => Sky::Picture {
                file: self.file(),
                layout: [SkyLayout::Panorama, SkyLayout::Cube, SkyLayout::Horizon][self.below(3) as usize],
                rotation: self.number(-360.0, 360.0),
                scale: self.number(0.0, 1e9),
            },
            _ => Sky::Daylight {
                turbidity: self.number(1.0, 10.0),
                scale: self.number(0.0, 1e9),
            },
        }
    }

    fn event(&mut self) -> Event {
        let (time, position, radius) = (self.wide(0.0, 1e3), self.vec2(), self.length());
        match self.below(7) {
            0 => Event::Drop {
                time,
                position,
                radius,
                volume: self.any(),
            },
            1 => Event::Press {
                time,
                position,
                radius,
                depth: self.any(),
            },
            2 => Event::Push {
                time,
                position,
                radius,
                velocity: Vec2::new(self.number(-9.0, 9.0), 1e6),
            },
            3 => Event::Sweep {
                start: time,
                end: time + 1.0,
                from: position,
                to: self.vec2(),
                radius,
                rate: self.number(-1e6, 1e6),
            },
            4 => Event::Inflow {
                start: time,
                end: self.option(|d| time + d.wide(1.0, 9.0)),
                position,
                radius,
                flow: Some(self.number(-1e3, 1e3)),
                series: None,
                points: Vec::new(),
            },
            5 => Event::Tilt {
                time,
                gravity: Vec3::new(self.number(-1e4, 1e4), -9.81, self.number(-1e4, 1e4)),
            },
            _ => Event::Rain {
                start: time,
                end: self.option(|d| time + d.wide(1.0, 9.0)),
                rate: self.length(),
                radius,
                volume: self.length(),
                adds_water: self.flip(),
            },
        }
    }
}
