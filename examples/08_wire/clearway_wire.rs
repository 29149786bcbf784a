// Clearway's wire without any crate: MessagePack, its length before it, on the standard streams.
use std::collections::HashMap;
use std::io::{self, Read, Write};

#[derive(Default)]
pub struct Value { // of a message: a number (true is 1), a text or an array's bytes, a list, a map, or nothing
    pub number: f64,
    pub bytes: Vec<u8>,
    list: Vec<Value>,
    map: HashMap<String, Value>,
}

impl Value {
    pub fn get(&self, key: &str) -> &Value { &self.map[key] }
    pub fn at(&self, i: usize) -> f64 { self.list[i].number }
    pub fn array(&self) -> impl Iterator<Item = f64> + '_ { // of float64
        self.bytes.chunks_exact(8).map(|c| f64::from_le_bytes([c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]]))
    }
}

fn whole(b: &mut &[u8], n: usize) -> u64 {
    let (head, rest) = b.split_at(n);
    *b = rest;
    head.iter().fold(0, |x, &byte| x << 8 | byte as u64)
}

fn read(b: &mut &[u8]) -> Value { // the value in MessagePack that stands first
    let (tag, mut v) = (whole(b, 1) as usize, Value::default());
    let (mut texts, mut items, mut pairs) = (0, 0, 0);
    match tag {
        0x00..=0x7f => v.number = tag as f64,
        0x80..=0x8f => pairs = tag & 15,
        0x90..=0x9f => items = tag & 15,
        0xa0..=0xbf => texts = tag & 31,
        0xc0 => {} // nothing
        0xc2 | 0xc3 => v.number = (tag & 1) as f64,
        0xc4..=0xc6 => texts = whole(b, 1 << (tag - 0xc4)) as usize,
        0xcb => v.number = f64::from_bits(whole(b, 8)),
        0xcc..=0xcf => v.number = whole(b, 1 << (tag - 0xcc)) as f64,
        0xd0..=0xd3 => { let n = 1 << (tag - 0xd0); v.number = ((whole(b, n) << (64 - 8 * n)) as i64 >> (64 - 8 * n)) as f64 }
        0xd9..=0xdb => texts = whole(b, 1 << (tag - 0xd9)) as usize,
        0xdc | 0xdd => items = whole(b, 2 << (tag - 0xdc)) as usize,
        0xde | 0xdf => pairs = whole(b, 2 << (tag - 0xde)) as usize,
        0xe0..=0xff => v.number = tag as f64 - 256.0,
        _ => panic!("MessagePack that no message of Clearway has"),
    }
    v.bytes = b[..texts].to_vec();
    *b = &b[texts..];
    v.list = (0..items).map(|_| read(b)).collect();
    v.map = (0..pairs).map(|_| (String::from_utf8(read(b).bytes).unwrap(), read(b))).collect();
    v
}

pub fn receive() -> Option<Value> { // None: Clearway has closed the line
    let mut length = [0; 4];
    io::stdin().read_exact(&mut length).ok()?;
    let mut body = vec![0; u32::from_be_bytes(length) as usize];
    io::stdin().read_exact(&mut body).ok()?;
    Some(read(&mut &body[..]))
}

pub fn text(s: &str) -> Vec<u8> { // in MessagePack; true is vec![0xc3], false vec![0xc2]
    [if s.len() < 32 { vec![0xa0 | s.len() as u8] } else { vec![0xda, (s.len() >> 8) as u8, s.len() as u8] }, s.as_bytes().to_vec()].concat()
}

pub fn texts(list: &[&str]) -> Vec<u8> {
    list.iter().fold(vec![0x90 | list.len() as u8], |packed, s| [packed, text(s)].concat())
}

pub fn number(x: f64) -> Vec<u8> { [&[0xcb], &x.to_be_bytes()[..]].concat() }

pub fn send(kind: &str, packed: &[(&str, Vec<u8>)]) {
    let mut body = [vec![0x81 + packed.len() as u8], text("type"), text(kind)].concat();
    for (key, value) in packed {
        body = [body, text(key), value.clone()].concat();
    }
    io::stdout().write_all(&[&(body.len() as u32).to_be_bytes(), &body[..]].concat()).unwrap();
    io::stdout().flush().unwrap();
}
