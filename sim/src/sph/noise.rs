//! Damping of what the particles cannot resolve.
//!
//! Nothing else takes energy from velocities that change from one particle to the next: a projection leaves what is free of
//! compression as it is. The force is that of viscosity along the line of a pair, but acts on what is left of the
//! difference of velocities when the linear field about both is taken off, v_ij − ½ (∇v_i + ∇v_j) x_ij. Smooth flows are
//! left alone (a linear one exactly, waves over some ten particles are not damped measurably); opposite forces along the
//! line of a pair keep linear and angular momentum. The viscosity of the water itself, where a step of it may be explicit, acts
//! on the whole difference in the same pass.

use super::correction::Local;
use super::fluid::Fluid;
use super::pressure::differences;
use super::viscosity;
use glam::Vec4;

/// The viscosity over the spacing times the speed of what is damped: that a fall of one spacing gives, and the
/// unresolved difference itself.
const STRENGTH: f32 = 0.7;
/// Largest viscosity times dt / spacing² of an explicit step.
const EXPLICIT: f32 = 0.07;

/// Gradient of the velocity: what it changes by along each axis.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gradient([Vec4; 3]);

impl Gradient {
    #[inline(always)]
    fn times(&self, x: Vec4) -> Vec4 {
        x.x * self.0[0] + x.y * self.0[1] + x.z * self.0[2]
    }
}

/// Damps the velocities over `dt` seconds, by explicit viscosity as well. `fluid.work.flow` holds them with their images, and
/// does after.
pub(super) fn damp(fluid: &mut Fluid, dt: f32) {
    let n = fluid.len();
    let work = &mut fluid.work;
    let (local, flow): (&[Local], &[Vec4]) = (&work.local, &work.flow);
    work.gradient.resize(n, Gradient::default());
    fluid.neighbours.map(&mut work.gradient, |near| {
        let sum = differences(&near, flow);
        Gradient(
            local[near.i]
                .rows
                .map(|row| -(row.x * sum[0] + row.y * sum[1] + row.z * sum[2])),
        )
    });
    let d = fluid.settings.spacing;
    let fall = (fluid.settings.gravity.length() * d).sqrt();
    let most = EXPLICIT * d * d / dt;
    let viscous = if viscosity::explicit(&fluid.settings, dt) {
        fluid.settings.viscosity
    } else {
        0.0
    };
    let soft = viscosity::soft(&fluid.kernel);
    let (gradient, place, mirrors) = (&work.gradient, &work.place, &fluid.mirrors);
    fluid.neighbours.map(&mut work.change, |near| {
        let i = near.i;
        let (p, v, own) = (place[i], flow[i], &gradient[i]);
        let mut sum = Vec4::ZERO;
        for (j, pair) in near.pairs() {
            let x = 0.5 * (p - place[j]);
            let linear = if j < n {
                own.times(x) + gradient[j].times(x)
            } else {
                let (source, sign) = mirrors.behind(j, n);
                let sign = sign.extend(0.0);
                own.times(x) + sign * gradient[source].times(sign * x)
            };
            // The fourth component is 0, so that of the pair takes no part.
            let difference = v - flow[j];
            let rest = difference - linear;
            let viscosity = (STRENGTH * d * (fall + rest.length())).min(most);
            let braked = viscosity * rest + viscous * difference;
            let weight = viscosity::weight(pair, 4.0 * x.length_squared(), soft);
            sum -= (weight * braked.dot(pair)) * pair;
        }
        (dt * sum.truncate()).extend(0.0)
    });
    for (v, change) in work.flow[..n].iter_mut().zip(&work.change) {
        *v += *change;
    }
    fluid.mirrors.extend_vectors(&mut work.flow, n);
}
