//! Where the time of a step goes.

use crate::solver::Solver;
use std::time::Instant;

/// Seconds spent in named stages, in the order in which they were first entered.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stages(Vec<(&'static str, f64)>);

impl Stages {
    /// Forgets the seconds; the memory of the list is kept.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Counts `seconds` for a stage.
    pub fn add(&mut self, name: &'static str, seconds: f64) {
        match self.0.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += seconds,
            None => self.0.push((name, seconds)),
        }
    }

    /// Counts the time since `start` for a stage, and begins the next one.
    pub fn lap(&mut self, name: &'static str, start: &mut Instant) {
        let now = Instant::now();
        self.add(name, now.duration_since(*start).as_secs_f64());
        *start = now;
    }

    /// Counts what a solver's latest step took since `start`: its own stages, or its name where it has none.
    pub fn of(&mut self, solver: &dyn Solver, start: &mut Instant) {
        let own = solver.stages();
        if own.is_empty() {
            self.lap(solver.name(), start);
        } else {
            self.add_all(own);
            *start = Instant::now();
        }
    }

    /// Counts all of another list.
    pub fn add_all(&mut self, others: &[(&'static str, f64)]) {
        for (name, seconds) in others {
            self.add(name, *seconds);
        }
    }

    /// Names and seconds.
    pub fn as_slice(&self) -> &[(&'static str, f64)] {
        &self.0
    }

    /// Seconds of all stages.
    pub fn total(&self) -> f64 {
        self.0.iter().map(|(_, seconds)| seconds).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_add_up_in_the_order_they_were_entered() {
        let mut stages = Stages::default();
        stages.add("flow", 1.0);
        stages.add("bodies", 2.0);
        stages.add("flow", 0.5);
        assert_eq!(stages.as_slice(), [("flow", 1.5), ("bodies", 2.0)]);
        let mut sum = stages.clone();
        sum.add_all(stages.as_slice());
        assert_eq!(sum.total(), 7.0);
        let mut start = Instant::now();
        stages.clear();
        stages.lap("a", &mut start);
        stages.lap("a", &mut start);
        assert!(stages.as_slice().len() == 1 && stages.total() >= 0.0);
    }
}
