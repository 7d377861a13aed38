//! The nearest known name to one that is unknown.

/// The candidate that differs from `name` by the fewest typing mistakes, if those are few for its length.
pub(crate) fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Nobody mistypes a name of this length into a known one; bounds the work on hostile input.
    if name.chars().count() > 64 {
        return None;
    }
    candidates
        .into_iter()
        .map(|c| (distance(name, c), c))
        .filter(|&(d, c)| d <= 1 + c.chars().count().min(name.chars().count()) / 3)
        .min_by_key(|&(d, _)| d)
        .map(|(_, c)| c)
}

/// Optimal string alignment distance: insertions, deletions, substitutions and swaps of neighbours; case is free.
fn distance(a: &str, b: &str) -> usize {
    let fold = |s: &str| {
        s.chars()
            .flat_map(char::to_lowercase)
            .map(|c| if c == '-' { '_' } else { c })
            .collect()
    };
    let (a, b): (Vec<char>, Vec<char>) = (fold(a), fold(b));
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for (i, row) in rows.iter_mut().enumerate() {
        row[0] = i;
    }
    rows[0] = (0..=b.len()).collect();
    for i in 1..=a.len() {
        for j in 1..=b.len() {
            let substitution = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut best = substitution.min(rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 1);
            }
            rows[i][j] = best;
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typing_mistakes_find_their_word_and_other_words_do_not() {
        let known = ["spacing", "scheme", "speed", "depth", "damping", "step"];
        assert_eq!(nearest("spaicng", known), Some("spacing"));
        assert_eq!(nearest("Spacing", known), Some("spacing"));
        assert_eq!(nearest("dampng", known), Some("damping"));
        assert_eq!(nearest("colour_of_the_boat", known), None);
        assert_eq!(nearest("x", known), None);
        assert_eq!(nearest(&"a".repeat(1_000_000), known), None);
    }

    #[test]
    fn the_distance_counts_mistakes() {
        for (a, b, d) in [
            ("", "", 0),
            ("abc", "abc", 0),
            ("ab", "ba", 1),
            ("abc", "", 3),
            ("kitten", "sitting", 3),
        ] {
            assert_eq!((distance(a, b), distance(b, a)), (d, d));
        }
    }
}
