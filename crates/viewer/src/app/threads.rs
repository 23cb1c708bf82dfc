//! What runs beside the window: bakes, drawing, the reference.

use super::{Posed, Said};
use crate::bake::Baker;
use crate::paint::{Painter, View};
use crate::reference::STEPS;
use crate::work::Desk;
use crate::{Shot, Wish, shoot};
use eframe::egui;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;
use steradian_base::{Progress, Task};
use steradian_session::Session;
use steradian_session::live::Live;

/// Progress that a window reads.
#[derive(Default)]
pub(super) struct Bar {
    pub label: Mutex<String>,
    pub done: AtomicU64,
    pub total: AtomicU64,
}

impl Progress for Bar {
    fn begin(&self, label: &str, total: u64) {
        *self.label.lock().unwrap_or_else(PoisonError::into_inner) = label.into();
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
    }

    fn advance(&self, steps: u64) {
        self.done.fetch_add(steps, Ordering::Relaxed);
    }

    fn end(&self) {
        self.done.store(self.total.load(Ordering::Relaxed), Ordering::Relaxed);
    }
}

/// What is to be baked.
pub(super) struct Order {
    pub wish: Wish,
    /// Is a preview shown first?
    pub preview: bool,
}

/// Threads and what they are asked.
pub(super) struct Threads {
    pub bakes: Vec<Arc<Desk<Order>>>,
    pub bars: Vec<Arc<Bar>>,
    pub paint: Arc<Desk<View>>,
    pub truth: Arc<Desk<Posed>>,
    pub truth_bar: Arc<Bar>,
    pub said: Receiver<Said>,
    pub say: Sender<Said>,
    pub running: Vec<JoinHandle<()>>,
    turntable: Option<(Arc<AtomicBool>, JoinHandle<()>)>,
    memory: u64,
    pub ctx: egui::Context,
}

impl Threads {
    pub fn start(ctx: &egui::Context, memory: u64) -> Self {
        let (say, said) = channel();
        let mut running = Vec::new();
        let (mut bakes, mut bars) = (Vec::new(), Vec::new());
        for side in 0..2 {
            let (desk, bar) = (Arc::new(Desk::<Order>::new()), Arc::new(Bar::default()));
            bakes.push(desk.clone());
            bars.push(bar.clone());
            let (say, ctx) = (say.clone(), ctx.clone());
            running.push(std::thread::spawn(move || {
                let mut baker = Baker::new(Session::new());
                while let Some((Order { wish, preview }, cancel)) = desk.next_protected() {
                    let start = Instant::now();
                    let task =
                        Task::quiet().with_max_memory(memory).with_progress(bar.clone()).with_cancel(cancel);
                    let shown = |early: Option<Arc<Live>>| {
                        if let Some(early) = early {
                            let seconds = start.elapsed().as_secs_f64();
                            let wish = Box::new(wish.clone());
                            let _ = say.send(Said::Baked { side, wish, made: Ok(early), seconds });
                            ctx.request_repaint();
                        }
                        desk.release();
                    };
                    let made = match preview {
                        true => baker.bake_after(&wish, task, shown),
                        false => {
                            desk.release();
                            baker.bake(&wish, task)
                        }
                    };
                    let seconds = start.elapsed().as_secs_f64();
                    let _ = say.send(Said::Baked { side, wish: Box::new(wish), made, seconds });
                    ctx.request_repaint();
                }
            }));
        }
        let paint = Arc::new(Desk::<View>::new());
        {
            let (desk, say, ctx) = (paint.clone(), say.clone(), ctx.clone());
            running.push(std::thread::spawn(move || paint_all(&desk, &say, &ctx)));
        }
        let (truth, truth_bar) = (Arc::new(Desk::<Posed>::new()), Arc::new(Bar::default()));
        {
            let (desk, bar, say, ctx) = (truth.clone(), truth_bar.clone(), say.clone(), ctx.clone());
            running.push(std::thread::spawn(move || refine(&desk, &bar, &say, &ctx, memory)));
        }
        Self {
            bakes,
            bars,
            paint,
            truth,
            truth_bar,
            said,
            say,
            running,
            turntable: None,
            memory,
            ctx: ctx.clone(),
        }
    }

    /// Is a turntable being drawn?
    pub fn is_turning(&self) -> bool {
        self.turntable.as_ref().is_some_and(|(_, t)| !t.is_finished())
    }

    /// Stops the turntable that is being drawn.
    pub fn stop_turning(&self) {
        if let Some((cancel, _)) = &self.turntable {
            cancel.store(true, Ordering::Relaxed);
        }
    }

    /// Draws a turn of the camera into a file, beside the window.
    pub fn turn(&mut self, wish: Wish, shot: Shot) {
        let (cancel, say, ctx, memory) =
            (Arc::<AtomicBool>::default(), self.say.clone(), self.ctx.clone(), self.memory);
        let flag = cancel.clone();
        let work = move || {
            let mut session = Session::new();
            session.task = Task::quiet().with_max_memory(memory).with_cancel(flag.clone());
            let made = shoot(session, &wish, &shot).map(|_| shot.file).map_err(|e| e.to_string());
            if made.is_ok() || !flag.load(Ordering::Relaxed) {
                let _ = say.send(Said::Turned(made));
            }
            ctx.request_repaint();
        };
        self.turntable = Some((cancel, std::thread::spawn(work)));
    }

    /// Ends all threads and waits for them: nothing is left behind.
    pub fn close(&mut self) {
        self.bakes.iter().for_each(|d| d.close());
        self.paint.close();
        self.truth.close();
        self.stop_turning();
        self.running.extend(self.turntable.take().map(|t| t.1));
        for t in self.running.drain(..) {
            let _ = t.join(); // a thread that panicked has nothing more to say
        }
    }
}

fn paint_all(desk: &Desk<View>, say: &Sender<Said>, ctx: &egui::Context) {
    let mut painter = match Painter::open() {
        Ok(p) => {
            let _ = say.send(Said::Opened(Ok((p.describe(), p.is_software()))));
            p
        }
        Err(e) => {
            let _ = say.send(Said::Opened(Err(e.to_string())));
            ctx.request_repaint();
            return;
        }
    };
    ctx.request_repaint();
    while let Some((view, _)) = desk.next() {
        let painted = painter.paint(&view).map(Box::new).map_err(|e| e.to_string());
        let _ = say.send(Said::Painted(painted));
        ctx.request_repaint();
    }
}

fn refine(desk: &Desk<Posed>, bar: &Arc<Bar>, say: &Sender<Said>, ctx: &egui::Context, memory: u64) {
    while let Some((posed, cancel)) = desk.next() {
        for (step, (part, tolerance)) in STEPS.into_iter().enumerate() {
            let mut session = Session::new();
            session.task =
                Task::quiet().with_max_memory(memory).with_progress(bar.clone()).with_cancel(cancel.clone());
            let size = posed.size.map(|n| n.div_ceil(part).max(1));
            let made = session.truth(&posed.live, posed.orbit.camera(), posed.turn, size, tolerance);
            let failed = made.is_err();
            let made = made.map(Arc::new);
            let _ = say.send(Said::True { made, step, of: Box::new(posed.clone()) });
            ctx.request_repaint();
            if failed {
                break;
            }
        }
    }
}
