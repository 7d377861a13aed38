//! Passes as data: what each reads and writes, what of it a wanted picture needs, and where it is kept.
//!
//! A [`Graph`] lists passes in an order in which they may run. [`Graph::plan`] walks back from what is wanted, drops every
//! pass that nothing wanted depends on, and lets transient resources whose lives do not meet share memory. Nothing
//! here knows a graphics interface; what a pass does is a value `W` that only its executor looks into.

use std::collections::BTreeSet;

/// A resource of a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ResourceId(usize);

/// Format of the texels of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Format {
    /// Four single-precision channels: radiance, places.
    Full,
    /// Four half-precision channels.
    Half,
    /// Reversed depth in single precision.
    Depth,
}

impl Format {
    /// Bytes of a texel.
    pub const fn bytes(self) -> u64 {
        match self {
            Self::Full => 16,
            Self::Half => 8,
            Self::Depth => 4,
        }
    }
}

/// What a resource is.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Made before the graph runs and kept after; its bytes are its own.
    Imported {
        /// Bytes held.
        bytes: u64,
    },
    /// A texture of the graph's own, gone after the last pass that reads it.
    Texture {
        /// Width and height.
        size: [u32; 2],
        /// Format of its texels.
        format: Format,
        /// Samples a texel: 1, or 4 where edges are smoothed.
        samples: u32,
    },
    /// A buffer of the graph's own, gone after the last pass that reads it.
    Buffer {
        /// Bytes.
        bytes: u64,
    },
}

impl Kind {
    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Imported { bytes } | Self::Buffer { bytes } => *bytes,
            Self::Texture {
                size,
                format,
                samples,
            } => u64::from(size[0]) * u64::from(size[1]) * format.bytes() * u64::from(*samples),
        }
    }
}

#[derive(Clone, Debug)]
struct Resource {
    name: &'static str,
    kind: Kind,
}

/// A step of the work.
#[derive(Clone, Debug)]
pub struct Pass<W> {
    /// Name, as in plans and timings.
    pub name: &'static str,
    /// What must be written before it runs. A resource that it changes in place is read and written.
    pub reads: Vec<ResourceId>,
    /// What it writes; what it does not read it overwrites as a whole.
    pub writes: Vec<ResourceId>,
    /// What it does.
    pub work: W,
}

/// Why a graph cannot be planned.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GraphError {
    /// A pass reads what nothing writes before it.
    #[error(
        "pass `{pass}` reads `{resource}`, which no pass before it writes; put the pass that writes it first"
    )]
    Unwritten {
        /// The pass.
        pass: &'static str,
        /// The resource.
        resource: &'static str,
    },
    /// Something is wanted that nothing writes.
    #[error("`{0}` is wanted, but no pass writes it")]
    Unreachable(&'static str),
}

/// A list of passes over a set of resources.
#[derive(Clone, Debug)]
pub struct Graph<W> {
    resources: Vec<Resource>,
    passes: Vec<Pass<W>>,
}

impl<W> Default for Graph<W> {
    fn default() -> Self {
        Self {
            resources: Vec::new(),
            passes: Vec::new(),
        }
    }
}

/// Memory that resources share one after the other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slot {
    /// What it is.
    pub kind: Kind,
    /// The resources that live in it, in the order of their lives.
    pub members: Vec<ResourceId>,
}

/// What runs and where things are kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Passes that run, by their place in the graph, in order.
    pub passes: Vec<usize>,
    /// Passes that nothing wanted depends on.
    pub dropped: Vec<usize>,
    /// Memory for the transient resources.
    pub slots: Vec<Slot>,
    /// Imported resources that are used.
    pub imported: Vec<ResourceId>,
    /// Bytes of slots and imported resources.
    pub bytes: u64,
}

impl<W> Graph<W> {
    /// Adds a resource.
    pub fn resource(&mut self, name: &'static str, kind: Kind) -> ResourceId {
        self.resources.push(Resource { name, kind });
        ResourceId(self.resources.len() - 1)
    }

    /// Adds a pass after those that are there.
    pub fn pass(&mut self, name: &'static str, reads: &[ResourceId], writes: &[ResourceId], work: W) {
        self.passes.push(Pass {
            name,
            reads: reads.to_vec(),
            writes: writes.to_vec(),
            work,
        });
    }

    /// The passes, in order.
    pub fn passes(&self) -> &[Pass<W>] {
        &self.passes
    }

    /// Name of a resource.
    pub fn name(&self, id: ResourceId) -> &'static str {
        self.resources[id.0].name
    }

    /// What a resource is.
    pub fn kind(&self, id: ResourceId) -> &Kind {
        &self.resources[id.0].kind
    }

    fn is_transient(&self, id: ResourceId) -> bool {
        !matches!(self.resources[id.0].kind, Kind::Imported { .. })
    }

    /// What must run for `wanted`, and the memory that takes.
    ///
    /// # Errors
    /// [`GraphError`] if a pass that runs reads a transient resource that was not written, or nothing writes what is
    /// wanted.
    pub fn plan(&self, wanted: &[ResourceId]) -> Result<Plan, GraphError> {
        for &id in wanted {
            if !self.passes.iter().any(|p| p.writes.contains(&id)) {
                return Err(GraphError::Unreachable(self.name(id)));
            }
        }
        let mut needed: BTreeSet<ResourceId> = wanted.iter().copied().collect();
        let mut passes = Vec::new();
        let mut dropped = Vec::new();
        for (k, pass) in self.passes.iter().enumerate().rev() {
            if !pass.writes.iter().any(|id| needed.contains(id)) {
                dropped.push(k);
                continue;
            }
            for id in &pass.writes {
                needed.remove(id);
            }
            needed.extend(pass.reads.iter().copied());
            passes.push(k);
        }
        passes.reverse();
        dropped.reverse();
        let mut written = BTreeSet::new();
        for &k in &passes {
            let pass = &self.passes[k];
            for &id in &pass.reads {
                if self.is_transient(id) && !written.contains(&id) {
                    return Err(GraphError::Unwritten {
                        pass: pass.name,
                        resource: self.name(id),
                    });
                }
            }
            written.extend(pass.writes.iter().copied());
        }
        let slots = self.allocate(&passes, wanted);
        let mut imported: Vec<ResourceId> = passes
            .iter()
            .flat_map(|&k| self.passes[k].reads.iter().chain(&self.passes[k].writes))
            .copied()
            .filter(|&id| !self.is_transient(id))
            .collect();
        imported.sort_unstable();
        imported.dedup();
        let bytes = slots.iter().map(|s| s.kind.bytes()).sum::<u64>()
            + imported.iter().map(|&id| self.kind(id).bytes()).sum::<u64>();
        Ok(Plan {
            passes,
            dropped,
            slots,
            imported,
            bytes,
        })
    }

    /// Slots for the transient resources, each given the first slot of its kind that is free when its life begins.
    fn allocate(&self, passes: &[usize], wanted: &[ResourceId]) -> Vec<Slot> {
        let mut lives: Vec<(usize, usize, ResourceId)> = Vec::new();
        for id in (0..self.resources.len())
            .map(ResourceId)
            .filter(|&id| self.is_transient(id))
        {
            let uses = || {
                passes.iter().enumerate().filter_map(|(n, &k)| {
                    let pass = &self.passes[k];
                    (pass.reads.contains(&id) || pass.writes.contains(&id)).then_some(n)
                })
            };
            if let (Some(first), Some(last)) = (uses().min(), uses().max()) {
                let last = if wanted.contains(&id) { usize::MAX } else { last };
                lives.push((first, last, id));
            }
        }
        lives.sort_unstable();
        let mut slots: Vec<(Slot, usize)> = Vec::new();
        for (first, last, id) in lives {
            let kind = self.kind(id);
            match slots
                .iter_mut()
                .find(|(slot, end)| slot.kind == *kind && *end < first)
            {
                Some((slot, end)) => {
                    slot.members.push(id);
                    *end = last;
                }
                None => slots.push((
                    Slot {
                        kind: kind.clone(),
                        members: vec![id],
                    },
                    last,
                )),
            }
        }
        slots.into_iter().map(|(slot, _)| slot).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture() -> Kind {
        Kind::Texture {
            size: [4, 2],
            format: Format::Half,
            samples: 1,
        }
    }

    /// a → b → c → d in a row, and a branch off a that nobody wants.
    fn chain() -> (Graph<()>, Vec<ResourceId>) {
        let mut graph = Graph::default();
        let heights = graph.resource("heights", Kind::Imported { bytes: 100 });
        let ids: Vec<_> = ["a", "b", "c", "d"]
            .map(|n| graph.resource(n, texture()))
            .to_vec();
        let side = graph.resource("side", Kind::Buffer { bytes: 7 });
        graph.pass("make a", &[heights], &[ids[0]], ());
        graph.pass("side", &[ids[0]], &[side], ());
        graph.pass("make b", &[ids[0]], &[ids[1]], ());
        graph.pass("make c", &[ids[1]], &[ids[2]], ());
        graph.pass("make d", &[ids[2]], &[ids[3]], ());
        (graph, ids)
    }

    #[test]
    fn what_nobody_wants_is_dropped_and_memory_is_shared() {
        let (graph, ids) = chain();
        let plan = graph.plan(&[ids[3]]).unwrap();
        assert_eq!(plan.passes, [0, 2, 3, 4]);
        assert_eq!(plan.dropped, [1]);
        // a and c share, b and d share: two textures of 64 bytes and the imported heights.
        assert_eq!(plan.slots.len(), 2);
        assert_eq!(plan.slots[0].members, [ids[0], ids[2]]);
        assert_eq!(plan.bytes, 2 * 64 + 100);
        // Wanting an early one keeps only what leads to it.
        assert_eq!(graph.plan(&[ids[0]]).unwrap().passes, [0]);
        // What is wanted is kept to the end: nothing may take its place.
        let both = graph.plan(&[ids[0], ids[3]]).unwrap();
        assert_eq!(both.slots.len(), 3);
    }

    #[test]
    fn a_later_overwrite_makes_the_earlier_pass_useless_and_a_change_in_place_does_not() {
        let mut graph = Graph::default();
        let a = graph.resource("a", texture());
        graph.pass("first", &[], &[a], ());
        graph.pass("over", &[], &[a], ());
        graph.pass("add", &[a], &[a], ());
        assert_eq!(graph.plan(&[a]).unwrap().passes, [1, 2]);
    }

    #[test]
    fn impossible_graphs_are_refused_by_name() {
        let mut graph = Graph::default();
        let a = graph.resource("a", texture());
        let b = graph.resource("b", texture());
        graph.pass("make b", &[a], &[b], ());
        assert_eq!(
            graph.plan(&[b]),
            Err(GraphError::Unwritten {
                pass: "make b",
                resource: "a"
            })
        );
        assert_eq!(graph.plan(&[a]), Err(GraphError::Unreachable("a")));
    }

    /// Random graphs: every pass kept has its inputs before it, every life in a slot ends before the next begins.
    #[test]
    fn plans_of_random_graphs_are_sound() {
        let mut state = 12345_u64;
        let mut random = move |n: usize| {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 33) as usize % n
        };
        for _ in 0..300 {
            let mut graph = Graph::default();
            let ids: Vec<_> = (0..8)
                .map(|k| {
                    let kind = if k % 3 == 0 {
                        Kind::Buffer { bytes: 8 }
                    } else {
                        texture()
                    };
                    graph.resource("r", kind)
                })
                .collect();
            let mut made: Vec<ResourceId> = Vec::new();
            for _ in 0..10 {
                let reads: Vec<_> = (0..random(3))
                    .filter_map(|_| made.get(random(8)).copied())
                    .collect();
                let write = ids[random(8)];
                graph.pass("p", &reads, &[write], ());
                made.push(write);
            }
            let wanted = made[random(made.len())];
            let plan = graph.plan(&[wanted]).unwrap();
            let touches = |k: usize, id| {
                graph.passes()[k].reads.contains(&id) || graph.passes()[k].writes.contains(&id)
            };
            for slot in &plan.slots {
                for pair in slot.members.windows(2) {
                    let last = plan.passes.iter().rposition(|&k| touches(k, pair[0])).unwrap();
                    let first = plan.passes.iter().position(|&k| touches(k, pair[1])).unwrap();
                    assert!(last < first);
                }
            }
            assert_eq!(plan.passes.len() + plan.dropped.len(), 10);
        }
    }
}
