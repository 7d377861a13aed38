//! The part of a walk that the filter still has to look at, in block columns and columns in the order of travel.

use super::blocks::{BLOCK, WINDOW};
use super::filter::ALL;
use super::walk::Walk;

/// Where a ray is on its walk. Bits of a mask stand for places in the order of travel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Route {
    /// The block column at the beginning of the window, and how many follow it to the last.
    block: u32,
    after: u32,
    backward: bool,
    /// Block columns of the window that are left.
    blocks: u32,
    /// The first column of the block at hand in the order of travel, and those of its columns that are left.
    column: u32,
    columns: u32,
    /// Columns of the first and of the last block that belong to the walk.
    in_first: u32,
    in_last: u32,
    short: bool,
}

impl Route {
    /// From `column` to the walk's last. A walk of one or two columns is not worth filtering: all its columns are to be solved.
    #[inline(always)]
    pub(crate) fn new(walk: &Walk, column: u32) -> Self {
        let size = BLOCK as u32;
        let backward = !walk.forward();
        let (block, last) = (column / size, walk.last / size);
        let (mut from, mut to) = (column % size, walk.last % size);
        if backward {
            (from, to) = (size - 1 - from, size - 1 - to);
        }
        let after = block.abs_diff(last);
        let in_last = ALL >> (size - 1 - to);
        let in_first = (ALL << from) & if after == 0 { in_last } else { ALL };
        let columns = match column.abs_diff(walk.last) {
            0 => 1,
            1 => 3,
            _ => 0,
        };
        let short = columns != 0;
        Self {
            block,
            after,
            backward,
            blocks: 0,
            column,
            columns,
            in_first,
            in_last,
            short,
        }
    }

    /// `block`, `n` block columns on.
    #[inline(always)]
    fn ahead(&self, n: u32) -> u32 {
        if self.backward {
            self.block.wrapping_sub(n)
        } else {
            self.block.wrapping_add(n)
        }
    }

    /// The first block column of the window.
    #[inline(always)]
    pub(crate) fn window(&self) -> u32 {
        self.block
    }

    /// Says which block columns of the window are to be looked into.
    #[inline(always)]
    pub(crate) fn set_blocks(&mut self, mask: u32) {
        let last = WINDOW as u32 - 1;
        self.blocks = mask & (ALL >> (last - self.after.min(last)));
    }

    #[inline(always)]
    pub(crate) fn has_blocks(&self) -> bool {
        self.blocks != 0
    }

    /// Goes to the next window; false if this is the last.
    #[inline(always)]
    pub(crate) fn next_window(&mut self) -> bool {
        let size = WINDOW as u32;
        if self.after < size {
            return false;
        }
        self.block = self.ahead(size);
        self.after -= size;
        self.in_first = ALL;
        true
    }

    /// Takes the next block column, with the columns of it that belong to the walk. There must be one.
    #[inline(always)]
    pub(crate) fn next_block(&mut self) -> (u32, u32) {
        let k = self.blocks.trailing_zeros();
        self.blocks &= self.blocks.wrapping_sub(1);
        let block = self.ahead(k);
        self.column = block * BLOCK as u32 + if self.backward { BLOCK as u32 - 1 } else { 0 };
        let in_first = if k == 0 { self.in_first } else { ALL };
        (block, in_first & if k == self.after { self.in_last } else { ALL })
    }

    /// Says which columns of the block are to be solved.
    #[inline(always)]
    pub(crate) fn set_columns(&mut self, mask: u32) {
        self.columns = mask;
    }

    /// Whether there is nothing but the columns that are set from the beginning.
    #[inline(always)]
    pub(crate) fn is_short(&self) -> bool {
        self.short
    }

    #[inline(always)]
    pub(crate) fn has_columns(&self) -> bool {
        self.columns != 0
    }

    /// Takes the next column. There must be one.
    #[inline(always)]
    pub(crate) fn next_column(&mut self) -> u32 {
        let k = self.columns.trailing_zeros();
        self.columns &= self.columns.wrapping_sub(1);
        if self.backward {
            self.column.wrapping_sub(k)
        } else {
            self.column.wrapping_add(k)
        }
    }
}
