// The connection to the server: JSON over a WebSocket. The token is behind the # of the address, which a browser
// sends to nobody; without it the page watches.

const RETRY_MS = 1000;
const token = new URLSearchParams(location.hash.slice(1)).get("token");

let socket = null;
let asked = 0;
let seen = 0;
const waiting = new Map();

// Connects, and again whenever the connection ends. `heard` gets the messages by their names: { frame: (body) => … },
// `changed` the state of the connection.
export function connect(heard, changed) {
  changed("connecting");
  socket = new WebSocket(`ws://${location.host}/socket`);
  socket.onopen = () => {
    seen = 0;
    changed("live");
    if (token) socket.send(JSON.stringify({ token }));
  };
  socket.onmessage = ({ data }) => {
    const message = JSON.parse(data);
    for (const [name, body] of Object.entries(message)) {
      if (name === "answer") answered(body);
      else heard[name]?.(body);
    }
    if (message.frame) {
      // The server sends no more than a few frames that have not been seen.
      seen += 1;
      socket.send(JSON.stringify({ seen }));
    }
  };
  socket.onclose = () => {
    for (const answer of waiting.values()) answer({ error: "the connection has gone" });
    waiting.clear();
    changed("gone");
    setTimeout(() => connect(heard, changed), RETRY_MS);
  };
}

// Sends a command. Resolves to { ok: true } once it has been passed on, or to { error, field }.
export function command(name, values = {}) {
  if (socket?.readyState !== WebSocket.OPEN) return Promise.resolve({ error: "there is no connection" });
  asked += 1;
  const id = asked;
  socket.send(JSON.stringify({ id, do: name, ...values }));
  return new Promise((resolve) => waiting.set(id, resolve));
}

function answered(answer) {
  waiting.get(answer.id)?.(answer);
  waiting.delete(answer.id);
}
