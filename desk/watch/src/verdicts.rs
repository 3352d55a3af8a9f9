//! What two streams of verdicts have in common, and what not.

/// An event at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// When, s.
    pub t_s: f64,
    /// The event's name.
    pub name: String,
}

/// Something that differs.
#[derive(Debug, Clone, PartialEq)]
pub enum Difference {
    /// It is in the first stream alone.
    First(Verdict),
    /// It is in the second stream alone.
    Second(Verdict),
    /// It comes so much later in the second stream than in the first, s.
    Moved(Verdict, f64),
}

impl Difference {
    /// When it is, s.
    pub fn t_s(&self) -> f64 {
        match self {
            Self::First(verdict) | Self::Second(verdict) | Self::Moved(verdict, _) => verdict.t_s,
        }
    }
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::First(Verdict { t_s, name }) => write!(f, "{t_s:9.3} s  - {name}"),
            Self::Second(Verdict { t_s, name }) => write!(f, "{t_s:9.3} s  + {name}"),
            Self::Moved(Verdict { t_s, name }, later_s) => {
                write!(f, "{t_s:9.3} s  ~ {name}, {:+.1} ms", 1e3 * later_s)
            }
        }
    }
}

/// Compares two streams. An event of the first is the same as the nearest one of that name in the second that is no
/// further away than `apart_s`; it has moved if that is further than `tolerance_s`.
pub fn compare(
    first: &[Verdict],
    second: &[Verdict],
    tolerance_s: f64,
    apart_s: f64,
) -> Vec<Difference> {
    let mut differences = Vec::new();
    let mut left: Vec<Option<&Verdict>> = second.iter().map(Some).collect();
    for verdict in first {
        let same = left
            .iter_mut()
            .filter_map(|place| {
                let other = (*place)?;
                let later_s = other.t_s - verdict.t_s;
                let is_same = other.name == verdict.name && later_s.abs() <= apart_s;
                is_same.then_some((place, later_s))
            })
            .min_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()));
        match same {
            None => differences.push(Difference::First(verdict.clone())),
            Some((place, later_s)) => {
                *place = None;
                if later_s.abs() > tolerance_s {
                    differences.push(Difference::Moved(verdict.clone(), later_s));
                }
            }
        }
    }
    let alone = left.into_iter().flatten();
    differences.extend(alone.map(|verdict| Difference::Second(verdict.clone())));
    differences.sort_by(|a, b| a.t_s().total_cmp(&b.t_s()));
    differences
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(verdicts: &[(f64, &str)]) -> Vec<Verdict> {
        let verdicts = verdicts.iter().map(|(t_s, name)| Verdict {
            t_s: *t_s,
            name: (*name).into(),
        });
        verdicts.collect()
    }

    fn differences(first: &[(f64, &str)], second: &[(f64, &str)]) -> Vec<String> {
        let found = compare(&stream(first), &stream(second), 0.005, 1.0);
        found.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn streams_that_differ_by_less_than_the_tolerance_are_the_same() {
        let first = [(1.0, "contact"), (1.001, "contact"), (2.0, "lost")];
        let second = [(1.001, "contact"), (1.002, "contact"), (1.996, "lost")];
        assert!(differences(&first, &second).is_empty());
        assert!(differences(&[], &[]).is_empty());
    }

    #[test]
    fn what_is_alone_and_what_has_moved_is_told_in_the_order_of_time() {
        let first = [(1.0, "contact"), (2.0, "lost"), (9.0, "released")];
        let second = [
            (0.5, "slip"),
            (1.0, "contact"),
            (2.03, "lost"),
            (11.0, "released"),
        ];
        assert_eq!(
            differences(&first, &second),
            [
                "    0.500 s  + slip",
                "    2.000 s  ~ lost, +30.0 ms",
                "    9.000 s  - released",
                "   11.000 s  + released"
            ]
        );
    }
}
