//! Prefiltering: an environment convolved with a kernel, as one map, a chain of levels, or an engine's files.

use crate::{Adjust, Error, LIGHT_KEY, Notice, Outcome, Session, light_mark};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;
use steradian_base::Missed;
use steradian_engines::{Filtered, Written};
use steradian_light::suns::{self, Taken};

/// One output.
#[derive(Clone)]
pub struct Request {
    /// Light: an image, or a sky spec.
    pub environment: String,
    /// How the light is read, rotated and scaled.
    pub adjust: Adjust,
    /// The maps to make of it.
    pub map: steradian_engines::Request,
    /// Are suns and lamps taken out of the light before it is filtered?
    pub extract_suns: bool,
    /// Folder for every level as a lat-long image.
    pub dump: Option<PathBuf>,
}

/// An output that was written.
pub struct Prefiltered {
    /// The filtered maps.
    pub made: Filtered,
    /// The files written.
    pub written: Vec<Written>,
    /// Suns that were taken out of the light, where the request says so.
    pub suns: Option<Taken>,
    /// Seconds of wall time by part.
    seconds: Map<String, Value>,
}

impl Prefiltered {
    /// Report as JSON.
    pub fn document(&self) -> Value {
        let mut document = self.made.document(&self.written, &self.seconds);
        if let Some(taken) = &self.suns {
            document["suns"] = taken.json();
        }
        document
    }

    /// Report in words, line by line.
    pub fn lines(&self) -> Vec<String> {
        self.made.lines(&self.written)
    }

    /// Message for a missed tolerance.
    pub fn missed(&self, m: Missed) -> String {
        let how = self.made.error_in_words();
        format!("relative RMS error {:.2e} is above {:.2e} ({how})", m.reached, m.asked)
    }
}

/// Times of consecutive parts, which add up to the total.
struct Clock {
    started: Instant,
    last: Instant,
    parts: Map<String, Value>,
}

impl Clock {
    /// A clock that was started at `started`; the time since then belongs to `part`.
    fn new(started: Instant, part: &str) -> Self {
        let mut clock = Self { started, last: started, parts: Map::new() };
        clock.lap(part);
        clock
    }

    /// Ends a part, which began where the last one ended.
    fn lap(&mut self, part: &str) {
        let now = Instant::now();
        self.parts.insert(part.into(), json!((now - self.last).as_secs_f64()));
        self.last = now;
    }

    /// Records parts that were timed elsewhere; the last one ends now.
    fn parts(&mut self, parts: &[(&str, f64)]) {
        let Some(((last, _), others)) = parts.split_last() else { return };
        let now = Instant::now();
        let mut left = (now - self.last).as_secs_f64();
        for (part, seconds) in others {
            self.parts.insert((*part).into(), json!(seconds));
            left -= seconds;
        }
        self.parts.insert((*last).into(), json!(left));
        self.last = now;
    }

    /// Seconds of wall time of each part, and of all.
    fn all(mut self) -> Map<String, Value> {
        self.parts.insert("all".into(), json!((self.last - self.started).as_secs_f64()));
        self.parts
    }
}

impl Session {
    /// Filters a light and writes the maps of the request.
    pub fn prefilter(&mut self, request: Request) -> Result<Outcome<Prefiltered>, Error> {
        let started = Instant::now();
        let Request { environment, adjust, mut map, extract_suns, dump } = request;
        // Of an engine only the folder is known to who announces outputs.
        if map.engine.is_some() {
            self.spares_in(&map.folder(), |file| map.writes(file))?;
        }
        if let Some(folder) = &dump {
            self.spares_in(folder, |file| map.dumps(file))?;
        }
        let mut lights = self.light(&environment, &adjust)?;
        let suns = extract_suns.then(|| suns::take(&mut lights));
        if let Some(taken) = &suns {
            self.note(taken.metadata());
            map.suns = taken.suns.clone();
        }
        self.check()?;
        let mut clock = Clock::new(started, "reading");
        let (mut made, missed) = Filtered::new(map, lights, &self.task)?.even_if_missed();
        self.note_error(format!("relative RMS error {:.2e} ({})", made.error(), made.error_in_words()));
        clock.parts(&made.seconds);
        if let Some(what) = made.beyond_in_words() {
            self.tell(Notice::Input { name: made.plan.engine.name.into(), what });
        }
        let mut metadata = self.provenance_pairs();
        metadata.push((LIGHT_KEY.into(), light_mark(&environment)));
        let written = made.write(&metadata)?;
        let share = written.iter().any(|w| w.report.clipped > 0).then(|| made.share_lost());
        written.iter().for_each(|w| self.tell_lost(Path::new(&w.name), w.report, share));
        clock.lap("writing");
        if let Some(folder) = &dump {
            made.dump(folder, &metadata, &self.task)?;
            clock.lap("dumping");
        }
        let reached = made.error();
        let done = Prefiltered { made, written, suns, seconds: clock.all() };
        Ok(Outcome::new(done, missed.map(|m| m.asked), reached))
    }
}
