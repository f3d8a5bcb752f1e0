// The WebSocket: receives the newest state and sends targets of hands. It reconnects after a break.

const listeners = {};
let socket;

/** Calls a function with each message of a type; `gone` and `here` report the connection. */
export function on(type, listener) {
  (listeners[type] ||= []).push(listener);
}
const tell = (type, message) => (listeners[type] || []).forEach((listener) => listener(message));

export function connect() {
  const address = new URL("live", location.href);
  address.protocol = address.protocol.replace("http", "ws");
  address.hash = address.search = "";
  socket = new WebSocket(address);
  socket.onopen = () => tell("here");
  socket.onmessage = (event) => {
    const message = JSON.parse(event.data);
    tell(message.type, message);
  };
  socket.onclose = () => {
    tell("gone");
    setTimeout(connect, 1000);
  };
}

/** Sends a message; nothing waits where the connection is slow. */
export function send(message) {
  if (socket?.readyState === WebSocket.OPEN && socket.bufferedAmount < 1 << 16) socket.send(JSON.stringify(message));
}
