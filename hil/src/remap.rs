//! The core, with its accesses to the settings' flash led to where the board has it answer.

use std::sync::Arc;

use rigless::emulator::{
    Access, Checked, CoreBus, CoreSpec, DataModel, Error, Exit, InterruptLine, Processor, Queued,
};
use rigless::soc::{Endian, Width};
use rigless::time::VirtualNanos;

use crate::flash::{BASE, SIZE, WINDOW};

/// Has a core's accesses led away.
pub fn remapped(mut spec: CoreSpec) -> CoreSpec {
    let inner = spec.processor.clone();
    spec.processor = Arc::new(move |endian| {
        let core = inner(endian)?;
        Ok(Box::new(Remapped(core)))
    });
    spec
}

#[derive(Debug)]
struct Remapped(Box<dyn Processor>);

/// The bus as the core has it.
struct Led<'a>(&'a mut dyn CoreBus);

fn led(mut access: Access) -> Access {
    if (BASE..BASE + SIZE as u64).contains(&access.address) {
        access.address += WINDOW - BASE;
    }
    access
}

impl CoreBus for Led<'_> {
    fn access(&mut self, access: Access, from_code: bool) -> Option<u64> {
        self.0.access(led(access), from_code)
    }

    fn time(&self, instructions: u64) -> VirtualNanos {
        self.0.time(instructions)
    }

    fn queued(&mut self) -> Vec<Queued> {
        self.0.queued()
    }

    fn carry_on(&mut self, instructions: u64, event: Option<VirtualNanos>) -> Option<u32> {
        self.0.carry_on(instructions, event)
    }

    fn acknowledge(&mut self, line: InterruptLine, instructions: u64) -> Option<u64> {
        self.0.acknowledge(line, instructions)
    }

    fn read_checked(&mut self, access: Access, report: bool) -> Option<Checked> {
        self.0.read_checked(access, report)
    }

    fn write_checked(&mut self, access: Access) -> Option<bool> {
        self.0.write_checked(access)
    }

    fn stops_before(&mut self, access: &Access) -> bool {
        self.0.stops_before(access)
    }

    fn send_trace(&mut self, bytes: &[u8]) {
        self.0.send_trace(bytes);
    }
}

/// What a debugger would ask for is left out: none is attached.
impl Processor for Remapped {
    fn run(&mut self, budget: u32, bus: &mut dyn CoreBus) -> (Exit, u64) {
        self.0.run(budget, &mut Led(bus))
    }

    fn retired(&self) -> u64 {
        self.0.retired()
    }

    fn ask(&mut self, queued: Queued) {
        self.0.ask(queued);
    }

    fn maps(&self, start: u64, length: u64) -> bool {
        self.0.maps(start, length)
    }

    fn page_size(&self) -> u64 {
        self.0.page_size()
    }

    #[expect(
        unsafe_code,
        reason = "the emulator's trait asks for it; nothing is done but to pass it on"
    )]
    unsafe fn map(&mut self, start: u64, length: u64, host: *mut u8, writable: bool) {
        // SAFETY: what the caller has promised.
        unsafe { self.0.map(start, length, host, writable) }
    }

    fn boot(&mut self, table: u64, read: &dyn Fn(u64, Width) -> Option<u64>) {
        let pages = (BASE..BASE + SIZE as u64).step_by(self.0.page_size() as usize);
        for page in pages {
            self.0.ask(Queued::Route(page));
        }
        self.0.boot(table, read);
    }

    fn reset(&mut self) {
        self.0.reset();
    }

    fn take_reset_request(&mut self) -> bool {
        self.0.take_reset_request()
    }

    fn next_event(&self) -> Option<VirtualNanos> {
        self.0.next_event()
    }

    fn on_event(&mut self, now: VirtualNanos) {
        self.0.on_event(now);
    }

    fn waiting(&self) -> bool {
        self.0.waiting()
    }

    fn pc(&self) -> u64 {
        self.0.pc()
    }

    fn add_breakpoint(&mut self, address: u64) -> bool {
        self.0.add_breakpoint(address)
    }

    fn remove_breakpoint(&mut self, address: u64) {
        self.0.remove_breakpoint(address);
    }

    fn pass_breakpoint(&mut self, address: u64) {
        self.0.pass_breakpoint(address);
    }

    fn data_model(&self) -> DataModel {
        self.0.data_model()
    }

    fn byte_order(&self, address: u64) -> Endian {
        self.0.byte_order(address)
    }

    fn save(&self) -> Vec<u8> {
        self.0.save()
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.0.load(bytes)
    }
}
