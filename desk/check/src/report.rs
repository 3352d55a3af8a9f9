//! What is kept of a check.

use std::fmt::Write;

use serde_json::{Value, json};
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;
use watch::told::Provenance;

use crate::faults;
use crate::finding::{Finding, STEPS, Verdict};

/// How a check has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ended {
    /// At its end.
    Whole,
    /// By Ctrl-C, or nobody was there to answer.
    Interrupted,
    /// The gripper was gone, and why.
    Gone(String),
}

/// A check.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// When it began, UTC, by RFC 3339.
    pub date: String,
    /// Where the gripper was.
    pub source: String,
    /// What gripper it was.
    pub about: Provenance,
    /// Settings that differ from this build's: name, value, and what it was built with.
    pub differing: Vec<(&'static str, f32, f32)>,
    /// Everything that was looked at, in its order.
    pub findings: Vec<Finding>,
    /// How it has ended.
    pub ended: Ended,
    /// The pressure was not seen to leave.
    pub is_under_pressure: bool,
}

/// Now, UTC, by RFC 3339, to the second.
pub(crate) fn now() -> anyhow::Result<String> {
    let now = OffsetDateTime::now_utc().replace_nanosecond(0)?;
    Ok(now.format(&Rfc3339)?)
}

impl Report {
    /// How many have come to this.
    pub fn count(&self, verdict: Verdict) -> usize {
        let findings = self.findings.iter();
        findings
            .filter(|finding| finding.verdict == verdict)
            .count()
    }

    /// Whether it has come to its end, and nothing has failed.
    pub fn has_passed(&self) -> bool {
        self.ended == Ended::Whole && self.count(Verdict::Failed) == 0
    }

    /// In one line.
    pub fn summary(&self) -> String {
        let counts = [
            Verdict::Passed,
            Verdict::Warned,
            Verdict::Failed,
            Verdict::NotTried,
        ];
        let counts = counts.map(|verdict| format!("{} {}", self.count(verdict), verdict.word()));
        let result = match &self.ended {
            Ended::Whole if self.has_passed() => "the gripper has passed",
            Ended::Whole => "the gripper has NOT passed",
            Ended::Interrupted => "ended before its end",
            Ended::Gone(why) => return format!("{why}: {}", counts.join(", ")),
        };
        format!("{result}: {}", counts.join(", "))
    }

    /// As a page.
    pub fn markdown(&self) -> String {
        let about = &self.about;
        let mut page = format!(
            "# Check of a gripper\n\n{}.\n\n| | |\n| --- | --- |\n| date | {} |\n| source | {} |\n| version | {} |\n| finger | {} {} |\n",
            cell(&self.summary()),
            self.date,
            cell(&self.source),
            cell(&about.version),
            cell(&about.table),
            cell(&about.recipe)
        );
        if self.is_under_pressure {
            page.push_str("\n**The pressure was not seen to leave.**\n");
        }
        page.push_str("\n## Settings that differ from the factory's\n\n");
        if self.differing.is_empty() {
            page.push_str("None.\n");
        }
        for (name, is, was) in &self.differing {
            // A string takes all.
            let _ = writeln!(page, "- `{name}` = {is}, not {was}");
        }
        for (step, name, expected) in STEPS {
            let _ = write!(
                page,
                "\n## {name}\n\nExpected: {expected}.\n\n| what | expected | seen | verdict | advice |\n| --- | --- | --- | --- | --- |\n"
            );
            for finding in self.findings.iter().filter(|finding| finding.step == step) {
                let cells = [
                    &finding.what,
                    &finding.expected,
                    &finding.seen,
                    finding.verdict.word(),
                    &finding.look_at,
                ];
                let _ = writeln!(page, "| {} |", cells.map(cell).join(" | "));
            }
        }
        page
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        let differing = self.differing.iter();
        let settings = differing
            .map(|(name, is, was)| json!({"name": name, "value": is, "factory": was}))
            .collect::<Vec<_>>();
        let findings = self.findings.iter().map(|finding| {
            json!({
                "step": finding.step.name(),
                "what": finding.what,
                "expected": finding.expected,
                "seen": finding.seen,
                "verdict": finding.verdict.word(),
                "fault": finding.fault.map(|fault| fault.code()),
                "page": finding.fault.map(faults::page),
                "look_at": finding.look_at,
            })
        });
        json!({
            "date": self.date,
            "source": self.source,
            "version": self.about.version,
            "recipe": self.about.recipe,
            "table": self.about.table,
            "passed": self.has_passed(),
            "summary": self.summary(),
            "pressure_not_seen_to_leave": self.is_under_pressure,
            "settings_that_differ": settings,
            "findings": findings.collect::<Vec<_>>(),
        })
    }
}

/// Text in a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}
