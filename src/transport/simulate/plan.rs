//! How a run is cut: rounds into blocks, blocks into pieces.

use crate::transport::photon_map::PieceKey;

/// Blocks of a run, and of each round of a run that goes on until it is accurate enough.
pub const BLOCKS: u64 = 128;

/// The cut of a round into blocks and pieces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plan {
    /// Blocks.
    pub blocks: u64,
    /// Histories of all blocks.
    pub histories: u64,
    /// Histories of a piece.
    pub piece: u64,
}

impl Plan {
    /// Of `histories`, at least `least` to a block.
    pub fn new(histories: u64, least: u64, piece: u64) -> Self {
        Self { blocks: BLOCKS.min(histories / least), histories, piece }
    }

    /// Histories of a block.
    pub fn block(&self, block: u64) -> u64 {
        self.histories / self.blocks + u64::from(block < self.histories % self.blocks)
    }

    /// Pieces of a block; the last one takes what is left over.
    pub fn pieces(&self, block: u64) -> u64 {
        (self.block(block) / self.piece).max(1)
    }

    /// First history and number of histories of a piece within its block.
    pub fn range(&self, block: u64, piece: u64) -> (u64, u64) {
        let first = piece * self.piece;
        let last = piece + 1 == self.pieces(block);
        (first, if last { self.block(block) - first } else { self.piece })
    }

    /// The same blocks, ended after `pieces` pieces each.
    pub fn ended_after(&self, pieces: u64) -> Self {
        Self { histories: self.blocks * pieces * self.piece, ..*self }
    }

    /// Histories before a piece, in the order of the photon map.
    pub fn histories_before(&self, (round, piece, block): PieceKey) -> u64 {
        let in_round: u64 = (0..self.blocks)
            .map(|b| {
                let whole = if b < block { piece + 1 } else { piece };
                if whole >= self.pieces(b) { self.block(b) } else { whole * self.piece }
            })
            .sum();
        round * self.histories + in_round
    }
}
