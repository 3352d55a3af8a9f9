//! The bus task.
use crate::board::Serial;

#[embassy_executor::task]
pub async fn run(mut serial: Serial) -> ! {
    let mut bytes = [0; 64];
    loop {
        serial.silence().await;
        let mut n = 0;
        while let Some(byte) = serial.received() {
            if let Some(b) = bytes.get_mut(n) {
                *b = byte;
                n += 1;
            }
        }
        serial.send(bytes.get(..n).unwrap_or_default()).await;
    }
}
