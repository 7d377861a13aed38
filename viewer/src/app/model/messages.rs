//! What the window has to tell: errors with what to do, and notes.

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Something was done.
    Note,
    /// Something is not as asked for.
    Warning,
    /// Something failed.
    Error,
}

/// A message, and how often it came.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// How much it matters.
    pub severity: Severity,
    /// What happened, and what to do.
    pub text: String,
    /// How often in a row.
    pub times: u32,
    /// When it came last, seconds of the clock of [`Messages::expire`].
    since: f64,
}

/// Messages, the newest last.
#[derive(Clone, Debug, Default)]
pub struct Messages {
    list: Vec<Message>,
    now: f64,
}

/// Seconds that a note stays.
const NOTE_SECONDS: f64 = 8.0;

/// Most messages that are kept.
const MOST: usize = 50;

impl Messages {
    /// Adds one; the same as one that is shown only counts.
    pub fn add(&mut self, severity: Severity, text: impl Into<String>) {
        let text = text.into();
        let known = self
            .list
            .iter()
            .position(|m| m.text == text && m.severity == severity);
        let times = known.map_or(1, |at| self.list.remove(at).times.saturating_add(1));
        self.list.push(Message {
            severity,
            text,
            times,
            since: self.now,
        });
        if self.list.len() > MOST {
            self.list.remove(0);
        }
    }

    /// A failure.
    pub fn error(&mut self, text: impl Into<String>) {
        self.add(Severity::Error, text);
    }

    /// Something that is not as asked for.
    pub fn warn(&mut self, text: impl Into<String>) {
        self.add(Severity::Warning, text);
    }

    /// Something that was done.
    pub fn note(&mut self, text: impl Into<String>) {
        self.add(Severity::Note, text);
    }

    /// It is `now`: what was only a note goes after a while.
    pub fn expire(&mut self, now: f64) {
        self.now = now;
        self.list
            .retain(|m| m.severity > Severity::Note || now - m.since < NOTE_SECONDS);
    }

    /// All of them.
    pub fn list(&self) -> &[Message] {
        &self.list
    }

    /// Forgets message `k`.
    pub fn dismiss(&mut self, k: usize) {
        if k < self.list.len() {
            self.list.remove(k);
        }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.list.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_message_is_counted_and_the_list_stays_short() {
        let mut messages = Messages::default();
        for _ in 0..3 {
            messages.error("no");
            messages.note("fine");
        }
        assert_eq!(messages.list().len(), 2);
        assert_eq!(
            (messages.list()[1].text.as_str(), messages.list()[1].times),
            ("fine", 3)
        );
        messages.expire(2.0 * NOTE_SECONDS);
        assert_eq!(messages.list().len(), 1);
        for k in 0..1000 {
            messages.warn(k.to_string());
        }
        assert_eq!(messages.list().len(), MOST);
        messages.dismiss(0);
        messages.dismiss(10_000);
        assert_eq!(messages.list().len(), MOST - 1);
    }
}
