//! Finds free places for labels and slope triangles.

use super::canvas::Point;

/// An upright rectangle in shown pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Box2 {
    min: Point,
    max: Point,
}

impl Box2 {
    pub(crate) fn new(min: Point, max: Point) -> Self {
        Self { min, max }
    }

    /// The box that reaches `dx`, `dy` around a point.
    pub(crate) fn around((x, y): Point, dx: f64, dy: f64) -> Self {
        Self::new((x - dx, y - dy), (x + dx, y + dy))
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.min.0 < other.max.0
            && other.min.0 < self.max.0
            && self.min.1 < other.max.1
            && other.min.1 < self.max.1
    }

    fn holds(&self, other: &Self) -> bool {
        self.min.0 <= other.min.0
            && other.max.0 <= self.max.0
            && self.min.1 <= other.min.1
            && other.max.1 <= self.max.1
    }
}

/// What is drawn already, inside the area in which things may be placed.
#[derive(Clone, Debug)]
pub(crate) struct Obstacles {
    area: Box2,
    boxes: Vec<Box2>,
}

impl Obstacles {
    pub(crate) fn new(area: Box2) -> Self {
        Self {
            area,
            boxes: Vec::new(),
        }
    }

    pub(crate) fn add_box(&mut self, b: Box2) {
        self.boxes.push(b);
    }

    /// Adds a line as a chain of small boxes.
    pub(crate) fn add_line(&mut self, points: &[Point]) {
        for pair in points.windows(2) {
            let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
            let steps = ((x1 - x0).hypot(y1 - y0) / 3.0).ceil().clamp(1.0, 1000.0);
            for k in 0..=steps as usize {
                let s = k as f64 / steps;
                self.add_box(Box2::around((x0 + s * (x1 - x0), y0 + s * (y1 - y0)), 1.5, 1.5));
            }
        }
    }

    fn is_free(&self, b: &Box2) -> bool {
        self.area.holds(b) && !self.boxes.iter().any(|o| o.overlaps(b))
    }

    /// A free place for a label of `size` near one of `ends`, nearest first: beside the end, then above and below in
    /// growing distance. Gives the middle of the label's left side and the end it belongs to, and takes the place.
    pub(crate) fn place_label(&mut self, ends: &[Point], size: (f64, f64)) -> Option<(Point, Point)> {
        let (width, height) = size;
        for &(dx, side) in &[(9.0, 0.0), (9.0, -1.0), (-9.0, 1.0)] {
            for step in 0..26 {
                // 0, up, down, further up …
                let dy = f64::from((step + 1) / 2) * 7.0 * if step % 2 == 1 { -1.0 } else { 1.0 };
                for &end in ends {
                    let left = match side {
                        s if s < 0.0 => end.0 - 0.5 * width,
                        s if s > 0.0 => end.0 + dx - width,
                        _ => end.0 + dx,
                    };
                    let at = (left, end.1 + dy);
                    let b = Box2::new(
                        (at.0 - 2.0, at.1 - 0.5 * height),
                        (at.0 + width, at.1 + 0.5 * height),
                    );
                    if self.is_free(&b) {
                        self.add_box(b);
                        return Some((at, end));
                    }
                }
            }
        }
        None
    }

    /// The top left corner of a free box of `size`, as near as there is to the lower left corner of the area, and
    /// takes it.
    pub(crate) fn place_box(&mut self, size: (f64, f64)) -> Option<Point> {
        let step = 8.0;
        let columns = ((self.area.max.0 - self.area.min.0 - size.0) / step).floor();
        let rows = ((self.area.max.1 - self.area.min.1 - size.1) / step).floor();
        if columns < 0.0 || rows < 0.0 {
            return None;
        }
        let mut places: Vec<Point> = (0..=columns as usize)
            .flat_map(|i| (0..=rows as usize).map(move |j| (i as f64 * step, j as f64 * step)))
            .map(|(right, up)| (self.area.min.0 + right, self.area.max.1 - size.1 - up))
            .collect();
        let (x0, y0) = (self.area.min.0, self.area.max.1 - size.1);
        places.sort_by(|a, b| (a.0 - x0).hypot(a.1 - y0).total_cmp(&(b.0 - x0).hypot(b.1 - y0)));
        let place = places
            .into_iter()
            .find(|&(x, y)| self.is_free(&Box2::new((x, y), (x + size.0, y + size.1))))?;
        self.add_box(Box2::new(place, (place.0 + size.0, place.1 + size.1)));
        Some(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_curves_that_end_together_do_not_overlap() {
        let mut obstacles = Obstacles::new(Box2::new((0.0, 0.0), (400.0, 300.0)));
        obstacles.add_line(&[(0.0, 10.0), (200.0, 150.0)]);
        let mut boxes: Vec<Box2> = Vec::new();
        for _ in 0..8 {
            let (at, end) = obstacles.place_label(&[(200.0, 150.0)], (90.0, 14.0)).unwrap();
            assert_eq!(end, (200.0, 150.0));
            let b = Box2::new((at.0, at.1 - 7.0), (at.0 + 90.0, at.1 + 7.0));
            assert!(boxes.iter().all(|o| !o.overlaps(&b)), "{b:?} {boxes:?}");
            boxes.push(b);
        }
    }

    #[test]
    fn a_box_goes_to_the_lower_left_where_that_is_free() {
        let mut obstacles = Obstacles::new(Box2::new((0.0, 0.0), (400.0, 300.0)));
        assert_eq!(obstacles.place_box((50.0, 40.0)), Some((0.0, 260.0)));
        let second = obstacles.place_box((50.0, 40.0)).unwrap();
        assert!(
            second != (0.0, 260.0) && second.0 < 60.0 && second.1 > 210.0,
            "{second:?}"
        );
        assert_eq!(obstacles.place_box((500.0, 40.0)), None);
    }
}
