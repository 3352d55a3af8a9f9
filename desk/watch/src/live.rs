//! What is told, for Foxglove while it comes: the topics of a recording over its WebSocket.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::Context as _;
use foxglove::websocket::{ChannelView, Client, ServerListener};
use foxglove::{ChannelBuilder, Context, PartialMetadata, RawChannel, Schema, WebSocketServer};

use crate::encoder::{Encoder, Message};
use crate::messages::{PROVENANCE, SETTINGS_IN_USE, TOPICS, Topic};
use crate::schema::{PACKAGE, descriptors};
use crate::told::Told;

/// What is told once, or seldom: its last message is sent again to whoever comes later.
const KEPT: [Topic; 2] = [PROVENANCE, SETTINGS_IN_USE];

/// A server that programs connect to, as long as this one runs.
pub struct Live {
    /// Where it listens.
    pub address: SocketAddr,
    encoder: Encoder,
    topics: Arc<Topics>,
    /// The server alone does not keep it.
    _context: Arc<Context>,
}

impl Live {
    /// Listens at an address; port 0 is any that is free.
    ///
    /// # Errors
    /// If the port is taken, or may not be used.
    pub fn open(address: SocketAddr) -> anyhow::Result<Self> {
        let context = Context::new();
        let schema = descriptors();
        let channels = TOPICS.iter().map(|topic| {
            let of = format!("{PACKAGE}.{}", topic.of);
            ChannelBuilder::new(topic.name)
                .context(&context)
                .schema(Schema::new(of, "protobuf", schema.clone()))
                .message_encoding("protobuf")
                .build_raw()
        });
        let topics = Arc::new(Topics {
            channels: channels.collect::<Result<_, _>>()?,
            kept: Mutex::default(),
        });
        // An address of version 6 keeps its brackets.
        let text = address.to_string();
        let host = text.rsplit_once(':').map_or("", |(host, _)| host);
        let server = WebSocketServer::new()
            .name("softgrip")
            .context(&context)
            .listener(Arc::clone(&topics) as Arc<dyn ServerListener>)
            .bind(host, address.port())
            .start_blocking()
            .with_context(|| {
                format!(
                    "{address}: cannot listen there: choose another port, or 0 for any that is free"
                )
            })?;
        Ok(Self {
            address: SocketAddr::new(address.ip(), server.port()),
            encoder: Encoder::new(),
            topics,
            _context: context,
        })
    }

    /// Tells whoever is connected. Who is too slow misses messages.
    pub fn add(&mut self, told: &Told) {
        for message in self.encoder.take(told) {
            self.topics.send(message);
        }
    }
}

/// The topics, and what of them is sent again.
struct Topics {
    /// In the order of [`TOPICS`].
    channels: Vec<Arc<RawChannel>>,
    /// One message for each topic at most.
    kept: Mutex<Vec<Message>>,
}

impl Topics {
    fn send(&self, message: Message) {
        // Who subscribes meanwhile gets it either way.
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let mut channels = TOPICS.iter().zip(&self.channels);
        if let Some((_, channel)) = channels.find(|(topic, _)| **topic == message.topic) {
            channel.log_with_meta(message.data.bytes(), time(&message));
        }
        if KEPT.contains(&message.topic) {
            kept.retain(|before| before.topic != message.topic);
            kept.push(message);
        }
    }
}

fn time(message: &Message) -> PartialMetadata {
    PartialMetadata::with_log_time(message.log_time)
}

impl ServerListener for Topics {
    fn on_subscribe(&self, client: Client, channel: ChannelView<'_>) {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let message = kept
            .iter()
            .find(|message| message.topic.name == channel.topic());
        let mut channels = self.channels.iter();
        if let (Some(message), Some(channel)) =
            (message, channels.find(|known| known.id() == channel.id()))
        {
            let bytes = message.data.bytes();
            channel.log_with_meta_to_sink(bytes, time(message), client.sink_id());
        }
    }
}
