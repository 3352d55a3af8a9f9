//! Requests as an independent codec has them.

use bus::modbus::{Exception, Function, Request};
use proptest::prelude::*;
use rusty_modbus_codec::error::DecodeError;
use rusty_modbus_codec::pdu::RequestPdu;

/// What a request asks for: address and values to write, address and count to read.
type Asked = (u16, Vec<u16>, u16, u16);

fn words(bytes: &[u8]) -> Vec<u16> {
    let words = bytes.chunks_exact(2);
    words.map(|w| u16::from_be_bytes([w[0], w[1]])).collect()
}

/// The oracle's view; none for functions that are not known here.
fn oracle(pdu: &[u8]) -> Option<Result<Asked, DecodeError>> {
    Function::of(*pdu.first()?)?;
    Some(
        rusty_modbus_codec::decode_request(pdu).map(|request| match request {
            RequestPdu::ReadHoldingRegisters(r) => (0, vec![], r.address.0, r.quantity.0),
            RequestPdu::ReadInputRegisters(r) => (0, vec![], r.address.0, r.quantity.0),
            RequestPdu::WriteSingleRegister(r) => (r.address.0, vec![r.value], 0, 0),
            RequestPdu::WriteMultipleRegisters(r) => (r.address.0, words(r.register_values), 0, 0),
            RequestPdu::ReadWriteMultipleRegisters(r) => (
                r.write_address.0,
                words(r.write_register_values),
                r.read_address.0,
                r.read_quantity.0,
            ),
            other => panic!("{other:?}"),
        }),
    )
}

fn ours(pdu: &[u8]) -> Result<Asked, Exception> {
    let request = Request::decode(pdu[0], &pdu[1..])?;
    assert_eq!(request.function as u8, pdu[0]);
    let read = request.read;
    let values = request.values.iter().collect();
    Ok((request.write_address, values, read.address, read.count))
}

/// Requests that are right but for a byte or two, and anything else.
fn pdus() -> impl Strategy<Value = Vec<u8>> {
    let code = prop_oneof![Just(3u8), Just(4), Just(6), Just(16), Just(23), any::<u8>()];
    let count = prop_oneof![0u16..130, any::<u16>()];
    let read = (any::<u16>(), count.clone());
    let write = (
        any::<u16>(),
        proptest::collection::vec(any::<u16>(), 0..125),
    );
    let wrong = (0..4u8, 0usize..12, any::<u8>());
    (code, read, write, wrong).prop_map(|(code, read, (address, values), wrong)| {
        let mut pdu = vec![code];
        if matches!(code, 3 | 4 | 23) {
            pdu.extend(read.0.to_be_bytes());
            pdu.extend(read.1.to_be_bytes());
        }
        if matches!(code, 16 | 23) {
            pdu.extend(address.to_be_bytes());
            pdu.extend((values.len() as u16).to_be_bytes());
            pdu.push((2 * values.len()) as u8);
            values.iter().for_each(|v| pdu.extend(v.to_be_bytes()));
        }
        if code == 6 {
            pdu.extend(address.to_be_bytes());
            pdu.extend(read.1.to_be_bytes());
        }
        match wrong {
            (0, at, byte) if at > 0 && at < pdu.len() => pdu[at] = byte,
            (1, at, _) => pdu.truncate(at.max(1)),
            (2, _, byte) => pdu.push(byte),
            _ => {}
        }
        pdu.truncate(253);
        pdu
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn a_request_is_what_an_independent_codec_makes_of_it(pdu in pdus()) {
        match (oracle(&pdu), ours(&pdu)) {
            (None, ours) => prop_assert_eq!(ours, Err(Exception::IllegalFunction)),
            (Some(Ok(theirs)), ours) => prop_assert_eq!(ours, Ok(theirs)),
            (Some(Err(_)), ours) => prop_assert_eq!(ours, Err(Exception::IllegalValue)),
        }
    }
}

#[test]
fn counts_end_where_the_protocol_says() {
    let read = |code: u8, count: u16| {
        let [upper, lower] = count.to_be_bytes();
        ours(&[code, 0, 0, upper, lower]).is_ok()
    };
    for code in [3, 4] {
        let counts = [0, 1, 125, 126].map(|count| read(code, count));
        assert_eq!(counts, [false, true, true, false]);
    }
    let write = |code: u8, count: u8| {
        let mut pdu = vec![code];
        if code == 23 {
            pdu.extend([0, 0, 0, 125]);
        }
        pdu.extend([0, 0, 0, count, count.wrapping_mul(2)]);
        pdu.extend(vec![0; 2 * usize::from(count)]);
        ours(&pdu).is_ok()
    };
    assert_eq!(
        [0, 1, 123, 124].map(|n| write(16, n)),
        [false, true, true, false]
    );
    assert_eq!(
        [0, 1, 121, 122].map(|n| write(23, n)),
        [false, true, true, false]
    );
}
