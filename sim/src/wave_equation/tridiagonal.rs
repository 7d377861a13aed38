//! Tridiagonal systems as diffusion makes them, several side by side so that the recursion vectorises.

/// Systems solved side by side.
pub(super) const LANES: usize = 8;

/// One value of each system.
pub(super) type Lanes = [f64; LANES];

/// One unknown of a tridiagonal system: (1 + neighbours·g) q̄ − g (q̄ before + q̄ after) = right.
pub(super) struct Face {
    pub(super) g: Lanes,
    pub(super) right: Lanes,
    pub(super) neighbours: f64,
}

impl Face {
    /// A face that lets nothing through.
    pub(super) const WALL: Self = Self {
        g: [0.0; LANES],
        right: [0.0; LANES],
        neighbours: 0.0,
    };
}

/// Tridiagonal systems side by side.
#[derive(Default)]
pub(super) struct Lines {
    /// What the next unknown contributes to each.
    next: Vec<Lanes>,
    /// The solution.
    pub(super) value: Vec<Lanes>,
    /// Of a wrapping system: what its first unknown contributes to each.
    first: Vec<Lanes>,
}

impl Lines {
    /// Solves for the unknowns `0..=n`. If `wrap`, unknown `n` is unknown 0 once more.
    pub(super) fn solve(&mut self, n: usize, wrap: bool, face: impl Fn(usize) -> Face) {
        self.next.resize(n + 1, [0.0; LANES]);
        self.value.resize(n + 1, [0.0; LANES]);
        if wrap {
            self.first.resize(n + 1, [0.0; LANES]);
            self.solve_wrapping(n, face);
        } else {
            self.solve_open(n, face);
        }
    }

    fn solve_open(&mut self, n: usize, face: impl Fn(usize) -> Face) {
        let (mut next, mut value) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..=n {
            let Face { g, right, neighbours } = face(i);
            for l in 0..LANES {
                let inverse = 1.0 / (1.0 + neighbours * g[l] - g[l] * next[l]);
                value[l] = (right[l] + g[l] * value[l]) * inverse;
                next[l] = g[l] * inverse;
            }
            self.next[i] = next;
            self.value[i] = value;
        }
        for i in (0..n).rev() {
            for ((value, own), next) in value.iter_mut().zip(self.value[i]).zip(self.next[i]) {
                *value = own + next * *value;
            }
            self.value[i] = value;
        }
    }

    /// Unknown 0 is kept as a parameter: each of the others is `value + first · q̄₀`, and the equation of unknown 0
    /// then gives q̄₀.
    fn solve_wrapping(&mut self, n: usize, face: impl Fn(usize) -> Face) {
        let (mut next, mut value, mut first) = ([0.0; LANES], [0.0; LANES], [1.0; LANES]);
        for i in 1..n {
            let Face { g, right, neighbours } = face(i);
            for l in 0..LANES {
                let inverse = 1.0 / (1.0 + neighbours * g[l] - g[l] * next[l]);
                value[l] = (right[l] + g[l] * value[l]) * inverse;
                first[l] *= g[l] * inverse;
                next[l] = g[l] * inverse;
            }
            self.next[i] = next;
            self.value[i] = value;
            self.first[i] = first;
        }
        (value, first) = ([0.0; LANES], [1.0; LANES]);
        self.value[n] = value;
        self.first[n] = first;
        for i in (1..n).rev() {
            for l in 0..LANES {
                value[l] = self.value[i][l] + self.next[i][l] * value[l];
                first[l] = self.first[i][l] + self.next[i][l] * first[l];
            }
            self.value[i] = value;
            self.first[i] = first;
        }
        self.value[0] = [0.0; LANES];
        self.first[0] = [1.0; LANES];
        let Face { g, right, neighbours } = face(0);
        let mut parameter = [0.0; LANES];
        for l in 0..LANES {
            let sum = self.value[1][l] + self.value[n - 1][l];
            let own = self.first[1][l] + self.first[n - 1][l];
            parameter[l] = (right[l] + g[l] * sum) / (1.0 + g[l] * (neighbours - own));
        }
        for (value, first) in self.value.iter_mut().zip(&self.first) {
            for ((value, first), parameter) in value.iter_mut().zip(first).zip(parameter) {
                *value += first * parameter;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest residual of the solution of a system with the given coefficients.
    fn residual(
        n: usize,
        wrap: bool,
        g: impl Fn(usize, usize) -> f64,
        right: impl Fn(usize, usize) -> f64,
    ) -> f64 {
        let neighbours = |i: usize| if wrap || (i > 0 && i < n) { 2.0 } else { 1.0 };
        let mut lines = Lines::default();
        lines.solve(n, wrap, |i| Face {
            g: std::array::from_fn(|l| g(i, l)),
            right: std::array::from_fn(|l| right(i, l)),
            neighbours: neighbours(i),
        });
        let mut worst = 0.0_f64;
        for l in 0..LANES {
            for i in 0..(if wrap { n } else { n + 1 }) {
                let q = |i: usize| lines.value[i][l];
                let before = if i > 0 {
                    q(i - 1)
                } else if wrap {
                    q(n - 1)
                } else {
                    0.0
                };
                let after = if i < n { q(i + 1) } else { 0.0 };
                let left = (1.0 + neighbours(i) * g(i, l)) * q(i) - g(i, l) * (before + after);
                worst = worst.max((left - right(i, l)).abs() / (1.0 + g(i, l)));
            }
            if wrap {
                assert_eq!(lines.value[0][l], lines.value[n][l]);
            }
        }
        worst
    }

    #[test]
    fn tridiagonal_systems_are_solved_open_and_wrapping() {
        let g = |i: usize, l: usize| {
            if (i * 7 + l).is_multiple_of(11) {
                0.0
            } else {
                1e3 * ((i + l) as f64).sin().abs()
            }
        };
        let right = |i: usize, l: usize| ((3 * i + l) as f64).cos();
        for n in [1, 2, 3, 50] {
            assert!(residual(n, false, g, right) < 1e-14, "{n}");
            assert!(residual(n, true, g, right) < 1e-14, "{n} wrapping");
        }
    }
}
