//! The sample buffer of captures: blocks of 4 × 4 samples, each as wide as a vector register.

/// Samples along the side of a block.
pub(super) const BLOCK: u32 = 4;

/// Samples of a block.
pub(super) const LANES: usize = (BLOCK * BLOCK) as usize;

/// Bits of the depth of a sample that shows nothing.
pub(super) const NOTHING: i32 = i32::MAX;

/// 4 × 4 samples, row by row.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Block {
    /// Bits of the depth from the scene's front, which is not negative.
    pub(super) depth: [i32; LANES],
    /// Numbers of the triangles.
    pub(super) triangle: [u32; LANES],
}

impl Block {
    const EMPTY: Self = Self { depth: [NOTHING; LANES], triangle: [u32::MAX; LANES] };
}

/// All samples of a view.
#[derive(Default)]
pub(super) struct Samples {
    blocks: Vec<Block>,
    /// The largest of each block.
    pub(super) farthest: Vec<i32>,
    /// Blocks across and down.
    pub(super) size: [u32; 2],
    /// Blocks that may have been written: columns and rows, ends excluded.
    pub(super) touched: [[u32; 2]; 2],
}

impl Samples {
    /// Empties the buffer for a grid of `width × height` samples.
    pub(super) fn clear(&mut self, [width, height]: [u32; 2]) {
        let size = [width.div_ceil(BLOCK), height.div_ceil(BLOCK)];
        if self.size == size {
            let [[left, right], [top, bottom]] = self.touched;
            for y in top..bottom {
                let row = (y * size[0]) as usize;
                let range = row + left as usize..row + right as usize;
                self.blocks[range.clone()].fill(Block::EMPTY);
                self.farthest[range].fill(NOTHING);
            }
        } else {
            let count = size[0] as usize * size[1] as usize;
            *self = Self {
                blocks: vec![Block::EMPTY; count],
                farthest: vec![NOTHING; count],
                size,
                touched: [[0; 2]; 2],
            };
        }
        self.touched = [[u32::MAX, 0]; 2];
    }

    /// Remembers that blocks of these columns and rows, ends included, may be written.
    #[inline(always)]
    pub(super) fn touch(&mut self, columns: [u32; 2], rows: [u32; 2]) {
        for (touched, [from, to]) in self.touched.iter_mut().zip([columns, rows]) {
            *touched = [touched[0].min(from), touched[1].max(to + 1)];
        }
    }

    /// Columns and rows of samples that may show something, of a grid of `size`.
    pub(super) fn touched_samples(&self, size: [u32; 2]) -> [std::ops::Range<u32>; 2] {
        std::array::from_fn(|k| {
            let [from, to] = self.touched[k];
            (from.min(to) * BLOCK)..(to * BLOCK).min(size[k])
        })
    }

    /// Number of the block at column `x` and row `y` of blocks.
    #[inline(always)]
    pub(super) fn number(&self, x: u32, y: u32) -> usize {
        (y * self.size[0] + x) as usize
    }

    #[inline(always)]
    pub(super) fn block_mut(&mut self, number: usize) -> &mut Block {
        &mut self.blocks[number]
    }

    /// Depth from the scene's front and triangle of sample (x, y), if it shows something.
    #[inline(always)]
    pub(super) fn get(&self, x: u32, y: u32) -> Option<(f32, u32)> {
        let block = &self.blocks[self.number(x / BLOCK, y / BLOCK)];
        let lane = (y % BLOCK * BLOCK + x % BLOCK) as usize;
        let depth = block.depth[lane];
        (depth != NOTHING).then(|| (f32::from_bits(depth as u32), block.triangle[lane]))
    }

    /// Whether all samples of these blocks, ends included, show something nearer than `nearest` (bits).
    #[inline(always)]
    pub(super) fn is_hidden(&self, columns: [u32; 2], rows: [u32; 2], nearest: i32) -> bool {
        (rows[0]..=rows[1]).all(|y| {
            let row = self.number(0, y);
            let blocks = &self.farthest[row + columns[0] as usize..=row + columns[1] as usize];
            blocks.iter().all(|&farthest| farthest < nearest)
        })
    }
}
