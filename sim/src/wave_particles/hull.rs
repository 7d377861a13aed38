//! Waves made by objects that move through the surface.
//!
//! A submerged face of area A that moves at v pushes the volume A (v·n) dt of water aside each dt (Yuksel, House & Keyser
//! 2007, §5). What is pushed comes to the surface around the object, at the silhouette of its submerged part seen from
//! above, and starts there as fronts that run outwards; faces that move away leave troughs. How the volume of a face
//! spreads over the silhouette is the harmonic measure of a disc, 1/distance²: that is how water under a flat body flows
//! out when pressed.
//!
//! The volumes of all faces are brought to add up to the change of the submerged volume, so that over any motion the
//! waves made hold exactly the water displaced.

use super::flight::Course;
use super::kernel::VOLUME;
use super::particle::Particle;
use super::sources::fresh;
use crate::frame::BodyPose;
use crate::mesh::TriangleMesh;
use crate::scene::description::AmplitudeLaw;
use glam::{DQuat, DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// How often a face is cut in four.
const DEEPEST: u32 = 4;

/// Shortest side of a silhouette, in distances between particles.
const SHORTEST: f64 = 0.05;

/// Flattest corner, off the line between its neighbours, in distances between particles: a circle of 64 sides has ten
/// times as much.
const FLATTEST: f64 = 1e-3;

/// Fewest particles around an object.
const FEWEST: usize = 12;

/// The submerged part of an object.
#[derive(Clone, Debug, Default)]
pub(super) struct Submerged {
    /// Area-weighted outward normals (m²) and centroids of the faces, clipped at the still surface.
    faces: Vec<(DVec3, DVec3)>,
    /// Volume, m³.
    pub(super) volume: f64,
    /// Plan view of the submerged vertices.
    plan: Vec<DVec2>,
}

impl Submerged {
    /// Adds a submerged triangle, cut into parts no larger than `finest` metres, so that what it pushes comes up where it
    /// is and not where its middle is.
    fn add(&mut self, [p, q, r]: [DVec3; 3], level: f64, finest: f64, depth: u32) {
        let longest = (q - p).length().max((r - q).length()).max((p - r).length());
        if depth > 0 && longest > finest {
            let (a, b, c) = (p.midpoint(q), q.midpoint(r), r.midpoint(p));
            for part in [[p, a, c], [a, q, b], [c, b, r], [a, b, c]] {
                self.add(part, level, finest, depth - 1);
            }
            return;
        }
        let area = 0.5 * (q - p).cross(r - p);
        let centroid = (p + q + r) / 3.0;
        // ∫ (y − level) n_y dA: exact for a flat face, and the open waterplane adds nothing.
        self.volume += area.y * (centroid.y - level);
        self.faces.push((area, centroid));
    }
}

/// Clips a closed mesh in a pose at the level of still water; faces are cut into parts of about `finest` metres.
pub(super) fn submerged(mesh: &TriangleMesh, pose: &BodyPose, level: f64, finest: f64) -> Submerged {
    let rotation = DQuat::from_xyzw(
        f64::from(pose.rotation.x),
        f64::from(pose.rotation.y),
        f64::from(pose.rotation.z),
        f64::from(pose.rotation.w),
    )
    .normalize();
    let origin = pose.position.as_dvec3();
    let points: Vec<DVec3> = mesh
        .positions
        .iter()
        .map(|p| origin + rotation * p.as_dvec3())
        .collect();
    let mut out = Submerged::default();
    for triangle in &mesh.triangles {
        let [Some(&a), Some(&b), Some(&c)] = triangle.map(|v| points.get(v as usize)) else {
            continue;
        };
        let polygon = below([a, b, c], level);
        for k in 1..polygon.len().saturating_sub(1) {
            out.add([polygon[0], polygon[k], polygon[k + 1]], level, finest, DEEPEST);
        }
        out.plan.extend(polygon.iter().map(|p| DVec2::new(p.x, p.z)));
    }
    out
}

/// The part of a triangle below a level.
fn below(corners: [DVec3; 3], level: f64) -> Vec<DVec3> {
    let mut out = Vec::with_capacity(4);
    for k in 0..3 {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        if p.y <= level {
            out.push(p);
        }
        if (p.y <= level) != (q.y <= level) {
            out.push(p + (level - p.y) / (q.y - p.y) * (q - p));
        }
    }
    out
}

/// The convex hull of points, anticlockwise from +X towards +Z, without repeats (Andrew 1979).
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..] {
                if (b - a).perp_dot(p - b) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut out = half(&mut points.iter().copied());
    out.extend(half(&mut points.iter().rev().copied()));
    out
}

/// A place on the silhouette where waves start.
#[derive(Clone, Copy, Debug)]
struct Port {
    place: DVec2,
    direction: DVec2,
    /// Angle to the neighbours' directions, radians.
    angle: f64,
    /// The side of the silhouette that it stands on.
    side: usize,
    /// Length of the silhouette that it stands for, metres.
    length: f64,
    /// Volume to send off, m³.
    volume: f64,
}

/// Angle of the outward normal of an edge of an anticlockwise polygon.
fn outward(a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    (-along.x).atan2(along.y)
}

/// The corners of a convex polygon without those that only rounding makes: nearer than `close` to the one before, or no
/// further than `flat` from the line between their neighbours.
fn merged(hull: &[DVec2], close: f64, flat: f64) -> Vec<DVec2> {
    let mut out = hull.to_vec();
    let mut k = 0;
    // Each is judged by the neighbours that are left, so that of two that stand together one stays.
    while k < out.len() && out.len() > 3 {
        let (last, corner, next) = (
            out[(k + out.len() - 1) % out.len()],
            out[k],
            out[(k + 1) % out.len()],
        );
        let chord = next - last;
        let off = (corner - last).perp_dot(chord).abs() / chord.length().max(f64::MIN_POSITIVE);
        if (corner - last).length() > close && off > flat {
            k += 1;
        } else {
            out.remove(k);
        }
    }
    out
}

/// Places around a silhouette, about `spacing` apart. Directions turn evenly along each side from the bisector at one end
/// to the bisector at the other, so that together they cover the full circle; `aim` divides the turn by what leaves the side.
fn ports(hull: &[DVec2], spacing: f64) -> Vec<Port> {
    let n = hull.len();
    if n < 3 {
        // A line or a point has no sides: a ring about its middle.
        let middle = hull.iter().sum::<DVec2>() / n.max(1) as f64;
        let angle = TAU / FEWEST as f64;
        return (0..FEWEST)
            .map(|k| Port {
                place: middle,
                direction: DVec2::from_angle(angle * (k as f64 + 0.5)),
                angle,
                side: 0,
                length: 0.0,
                volume: 0.0,
            })
            .collect();
    }
    let perimeter: f64 = (0..n).map(|k| (hull[(k + 1) % n] - hull[k]).length()).sum();
    let spacing = spacing.min(perimeter / FEWEST as f64);
    // A hull turned by a rounding error has its upper and lower corners a hair apart, and corners in the middle of its
    // sides. Such a side has no length for the volume that belongs to its share of the turn.
    let hull = &merged(hull, SHORTEST * spacing, FLATTEST * spacing)[..];
    let n = hull.len();
    let normal: Vec<f64> = (0..n).map(|k| outward(hull[k], hull[(k + 1) % n])).collect();
    // Half of the turn at the corner at the start of side k.
    let half_turn = |k: usize| 0.5 * (normal[k % n] - normal[(k + n - 1) % n]).rem_euclid(TAU);
    let mut out = Vec::new();
    for k in 0..n {
        let (a, b) = (hull[k], hull[(k + 1) % n]);
        let length = (b - a).length();
        // The hair keeps sides that are a whole number of spacings, as a square's are, from one part more by rounding.
        let parts = (length / spacing - 1e-2).ceil().max(1.0);
        let (first, last) = (normal[k] - half_turn(k), normal[k] + half_turn(k + 1));
        for part in 0..parts as usize {
            let share = (part as f64 + 0.5) / parts;
            out.push(Port {
                place: a + share * (b - a),
                direction: DVec2::from_angle(first + share * (last - first)),
                angle: (last - first).clamp(0.0, PI) / parts,
                side: k,
                length: length / parts,
                volume: 0.0,
            });
        }
    }
    out
}

/// Turns the directions along each side by the volume that leaves it in place of by its length, between the same ends:
/// `given` holds what every port gives when the object is pressed straight down. Equal angles then hold equal volumes and a
/// heaving box makes round rings; by length, the middle of a side, which is nearest to the water under the box, would send
/// a quarter more into its angle than the ends.
fn aim(ports: &mut [Port], given: &[f64]) {
    let mut from = 0;
    while from < ports.len() {
        let side = ports[from].side;
        let to = from + ports[from..].iter().take_while(|p| p.side == side).count();
        let whole: f64 = given[from..to].iter().sum();
        if whole > 0.0 && whole.is_finite() {
            let turn = ports[from].angle * (to - from) as f64;
            let mut angle = ports[from].direction.to_angle() - 0.5 * ports[from].angle;
            for (port, volume) in ports[from..to].iter_mut().zip(&given[from..to]) {
                port.angle = turn * volume / whole;
                port.direction = DVec2::from_angle(angle + 0.5 * port.angle);
                angle += port.angle;
            }
        }
        from = to;
    }
}

/// What every port gives when the object is pressed straight down, whichever way its faces look.
fn given_by_heave(shape: &Submerged, ports: &[Port]) -> Vec<f64> {
    let mut pressed = ports.to_vec();
    for &(area, centroid) in &shape.faces {
        if area.y != 0.0 {
            spread(area.y.abs(), DVec2::new(centroid.x, centroid.z), &mut pressed);
        }
    }
    pressed.iter().map(|p| p.volume).collect()
}

/// How objects make waves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wake {
    pub(super) law: AmplitudeLaw,
    /// Radius of the particles, metres.
    pub(super) radius: f64,
    /// Elevation of still water above datum, metres.
    pub(super) level: f64,
}

impl Wake {
    /// Seconds between the fronts that an object sends off: they follow each other by half a radius, so that a steady
    /// motion makes an even wave.
    pub(super) fn interval(&self, speed: f64) -> f64 {
        0.5 * self.radius / speed
    }

    /// The particles for what an object displaced between two poses, starting at `time`; returns the volume of those
    /// that would start where there is no water.
    pub(super) fn particles(
        &self,
        mesh: &TriangleMesh,
        [before, middle, after]: &[BodyPose; 3],
        course: &Course,
        [start, time]: [f64; 2],
        out: &mut Vec<Particle>,
    ) -> f64 {
        if before == after {
            return 0.0;
        }
        let dt = time - start;
        let [was, now, is] =
            [before, middle, after].map(|pose| submerged(mesh, pose, self.level, 0.5 * self.radius));
        let displaced = is.volume - was.volume;
        // An object that comes out of the water within the interval is as wet as it was before.
        let shape = [&now, &is, &was].into_iter().find(|s| !s.plan.is_empty());
        let Some(shape) = shape else {
            return 0.0;
        };
        let silhouette = hull(shape.plan.clone());
        let mut ports = ports(&silhouette, course.split * self.radius);
        if silhouette.len() >= 3 {
            let given = given_by_heave(shape, &ports);
            aim(&mut ports, &given);
        }
        ports.retain(|p| course.is_water(p.place));
        if ports.is_empty() {
            return displaced;
        }
        let origin = middle.position.as_dvec3();
        let turn = middle.angular_velocity.as_dvec3();
        // The mean velocity over the interval: the exact displacement, whatever the path does in between.
        let velocity = (after.position.as_dvec3() - before.position.as_dvec3()) / dt;
        let mut sum = 0.0;
        for &(area, centroid) in &now.faces {
            let pushed = area.dot(velocity + turn.cross(centroid - origin)) * dt;
            if pushed != 0.0 {
                spread(pushed, DVec2::new(centroid.x, centroid.z), &mut ports);
                sum += pushed;
            }
        }
        let perimeter: f64 = ports.iter().map(|p| p.length.max(f64::MIN_POSITIVE)).sum();
        for port in &mut ports {
            port.volume += (displaced - sum) * port.length.max(f64::MIN_POSITIVE) / perimeter;
        }
        for p in ports.iter().filter(|p| p.volume != 0.0) {
            let amplitude = p.volume / (VOLUME * self.radius * self.radius);
            out.push(Particle {
                angle: p.angle,
                spacing: p.length,
                reference: match self.law {
                    AmplitudeLaw::Volume => 0.0,
                    AmplitudeLaw::Energy if p.angle > 0.0 => (p.length / p.angle).max(self.radius),
                    AmplitudeLaw::Energy => 0.0,
                },
                ..fresh(p.place, p.direction, time, self.radius, amplitude)
            });
        }
        0.0
    }
}

/// Spreads a volume pushed at a point over the silhouette.
fn spread(volume: f64, from: DVec2, ports: &mut [Port]) {
    let weight = |p: &Port| {
        let length = p.length.max(1e-9);
        // On the silhouette itself the measure is a point; half a side's length stands for its width.
        length / ((p.place - from).length_squared() + 0.25 * length * length)
    };
    let whole: f64 = ports.iter().map(weight).sum();
    if whole > 0.0 && whole.is_finite() {
        for port in ports {
            port.volume += volume * weight(port) / whole;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    #[test]
    fn the_submerged_volume_is_exact() {
        let mesh = TriangleMesh::cuboid(Vec3::new(2.0, 1.0, 3.0));
        let pose = |y: f32, turn: Quat| BodyPose {
            position: Vec3::new(4.0, y, -7.0),
            rotation: turn,
            ..BodyPose::default()
        };
        for (y, expected) in [(1.0, 0.0), (0.2, 1.8), (0.0, 3.0), (-0.5, 6.0), (-9.0, 6.0)] {
            let found = submerged(&mesh, &pose(y, Quat::IDENTITY), 0.0, 0.7).volume;
            assert!((found - expected).abs() < 1e-6, "{y}: {found}");
        }
        // Half under, however it is turned about its middle.
        let turn = Quat::from_rotation_x(0.7) * Quat::from_rotation_z(0.4);
        let turned = submerged(&mesh, &pose(0.0, turn), 0.0, 9.0);
        assert!((turned.volume - 3.0).abs() < 1e-6, "{}", turned.volume);
    }

    #[test]
    fn a_rounding_error_leaves_the_silhouette_as_it_was() {
        let square = [
            DVec2::new(-1.0, -1.0),
            DVec2::new(1.0, -1.0),
            DVec2::new(1.0, 1.0),
            DVec2::new(-1.0, 1.0),
        ];
        let twice: Vec<DVec2> = square
            .iter()
            .flat_map(|c| [*c, *c + 1e-7 * DVec2::new(-c.y, c.x)])
            .chain([DVec2::new(0.1, 1.0 + 1e-9), DVec2::new(1.0 + 1e-9, -0.7)])
            .collect();
        let sorted = |corners: Vec<DVec2>| {
            let mut ports = ports(&hull(corners), 0.25);
            ports.sort_by(|a, b| a.place.to_angle().total_cmp(&b.place.to_angle()));
            ports
        };
        let (plain, split) = (sorted(square.to_vec()), sorted(twice));
        assert_eq!(plain.len(), split.len());
        for (a, b) in plain.iter().zip(&split) {
            assert!((a.direction - b.direction).length() < 1e-6 && (a.length - b.length).abs() < 1e-6);
        }
    }

    #[test]
    fn directions_around_a_silhouette_cover_the_circle() {
        let square = hull(vec![
            DVec2::new(1.0, 1.0),
            DVec2::new(-1.0, 1.0),
            DVec2::ZERO,
            DVec2::new(-1.0, -1.0),
            DVec2::new(1.0, -1.0),
            DVec2::new(1.0, 0.0),
        ]);
        assert_eq!(square.len(), 4);
        let ports = ports(&square, 0.3);
        let turn: f64 = ports.iter().map(|p| p.angle).sum();
        assert!((turn - TAU).abs() < 1e-12, "{turn}");
        assert!((ports.iter().map(|p| p.length).sum::<f64>() - 8.0).abs() < 1e-12);
        assert!(
            ports
                .iter()
                .all(|p| p.direction.dot(p.place) > 0.7 * p.place.length())
        );
        for pair in ports.windows(2) {
            let between = pair[0].direction.angle_to(pair[1].direction);
            assert!(between > 0.0 && between < 0.4, "they turn one way: {between}");
        }
    }
}
