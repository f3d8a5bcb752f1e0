//! `teachtree teach --live --host`: TLS for other machines, spoken by another party's libraries, OpenSSL and websockets.

use crate::program::{complained, program, python_with, teachtree_in};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use teachtree_serve::duplex_stream::DuplexStream;
use teachtree_serve::{Certificate, Host};

/// A program that serves with TLS, and ends with this.
struct TlsProgram {
    process: Child,
    /// The address, what to do, what the certificate is, its fingerprint.
    lines: [String; 4],
}

impl TlsProgram {
    fn start(folder: &Path, args: &[&str]) -> Self {
        let args = [&["teach", "pick_and_place", "--live", "--no-open", "--host", "127.0.0.1"], args].concat();
        let mut process = program(folder, &args).stdout(Stdio::piped()).stderr(Stdio::inherit()).spawn().unwrap();
        let mut out = BufReader::new(process.stdout.take().unwrap());
        let mut lines = [const { String::new() }; 4];
        for line in &mut lines {
            out.read_line(line).unwrap();
            line.truncate(line.trim_end().len());
        }
        Self { process, lines }
    }
}

impl Drop for TlsProgram {
    fn drop(&mut self) {
        // It may be gone already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

const CLIENT: &str = r#"
import asyncio, hashlib, http.client, json, socket, ssl, sys, urllib.parse, websockets
address, fingerprint, pem = sys.argv[1:]
url = urllib.parse.urlsplit(address)
trust = ssl.create_default_context(cafile=pem)

def tcp():
    return socket.create_connection((url.hostname, url.port), timeout=20)

def whole(connection):
    parts = []
    while part := connection.recv(65536):
        parts.append(part)
    return b"".join(parts)

# More connections than there may be that say nothing, or begin a handshake and never end it.
waiting = [tcp() for _ in range(80)]
for one in waiting[::2]:
    one.sendall(bytes.fromhex("1603010200010001fc0303"))

with tcp() as plain:
    plain.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
    answer = whole(plain)
    assert answer.startswith(b"HTTP/1.1 400 ") and answer.endswith(b'{"error":"the address begins with https://"}'), answer
with tcp() as plain:
    plain.sendall(b"\0" * 100)
    assert whole(plain).startswith(b"HTTP/1.1 400 ")
with tcp() as broken:
    broken.sendall(b"\x16\x03\x01\x00\x05hello")
    whole(broken)

def refused(context, kind):
    try:
        context.wrap_socket(tcp(), server_hostname=url.hostname)
    except kind:
        return
    raise AssertionError("it is not refused")

refused(ssl.create_default_context(), ssl.SSLCertVerificationError)
old = ssl.create_default_context(cafile=pem)
old.maximum_version = ssl.TLSVersion.TLSv1_2
refused(old, ssl.SSLError)

# Without the end of TLS, the end of the connection would be an error here.
def ask(path, host=url.netloc):
    with trust.wrap_socket(tcp(), server_hostname=url.hostname, suppress_ragged_eofs=False) as secure:
        secure.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode())
        digest = hashlib.sha256(secure.getpeercert(True)).hexdigest().upper()
        assert fingerprint.replace(":", "") == digest, digest
        answer = whole(secure)
        return int(answer.split(b" ")[1]), answer.decode()

status, page = ask(url.path)
assert status == 200 and 'id="stage"' in page, page
assert len(ask(url.path + "show.js")[1]) > 4000
assert ask("/" + "0" * 32 + "/")[0] == 403
assert ask(url.path, "localhost:%d" % url.port)[0] == 403

async def speak():
    live = address.replace("https:", "wss:") + "live"
    for wrong in [dict(origin="https://example.org"), dict(origin=f"http://{url.netloc}")]:
        try:
            await websockets.connect(live, ssl=trust, **wrong)
            raise AssertionError("it is not refused")
        except websockets.InvalidStatus as error:
            assert error.response.status_code == 403
    async with websockets.connect(live, ssl=trust, origin=f"https://{url.netloc}") as device:
        await device.send('{"type":"forces","every_ms":1}')
        heard = {}

        async def hear():
            async for text in device:
                message = json.loads(text)
                heard[message["type"]] = heard.get(message["type"], 0) + 1
                if "jump" in message.get("message", ""):
                    return message

        async def tell():
            for n in range(2000):
                palm = [0.1, 0.0, 0.2 + n * 1e-6, 1, 0, 0, 0]
                await device.send(json.dumps({"type": "palm", "hand": "right", "palm": palm}))
                if n % 100 == 0:
                    await asyncio.sleep(0.01)
            await device.send('{"type":"jump"}')

        await asyncio.gather(hear(), tell())
        assert heard["forces"] > 20 and heard["state"] > 2, heard

asyncio.run(asyncio.wait_for(speak(), 60))
# Who came first and said nothing has made room.
assert waiting[0].recv(1) == b""
print("well")
"#;

#[test]
fn another_machine_opens_the_page_and_speaks_to_it_by_tls() {
    let Some(python) = python_with("websockets", "websockets") else { return };
    let folder = tempfile::tempdir().unwrap();
    let serving = TlsProgram::start(folder.path(), &["--certificate", "bench.pem"]);
    let [address, _, certificate, fingerprint] = &serving.lines;
    assert_eq!(certificate, "certificate, signed by itself and new in bench.pem; SHA-256 fingerprint:");
    let pem = folder.path().join("bench.pem");
    let output = Command::new(python).args(["-c", CLIENT, address, fingerprint]).arg(&pem).output().unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stdout), "well\n", "{}", String::from_utf8_lossy(&output.stderr));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        assert_eq!(std::fs::metadata(&pem).unwrap().permissions().mode() & 0o777, 0o600);
    }
    // It is the same one the next time.
    let again = TlsProgram::start(folder.path(), &["--certificate", "bench.pem"]);
    assert_eq!(again.lines[2..], ["certificate in bench.pem; SHA-256 fingerprint:", fingerprint]);
}

/// Sends without reading, and then reads.
const UNEVEN: &str = r#"
import socket, ssl, sys
port, pem = int(sys.argv[1]), sys.argv[2]
trust = ssl.create_default_context(cafile=pem)
with trust.wrap_socket(socket.create_connection(("127.0.0.1", port)), server_hostname="127.0.0.1", suppress_ragged_eofs=False) as secure:
    secure.sendall(bytes(1 << 20))
    sys.stdin.readline()
    count = 0
    while part := secure.recv(1 << 20):
        assert part == bytes([7]) * len(part)
        count += len(part)
    print(count)
"#;

#[test]
fn who_reads_is_not_held_up_by_who_cannot_write() {
    let Some(python) = python_with("ssl", "ssl") else { return };
    const MANY: usize = 32 << 20;
    let folder = tempfile::tempdir().unwrap();
    let pem = folder.path().join("bench.pem");
    let certificate = Certificate::make_file(&pem, &Host::parse("127.0.0.1").unwrap()).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port().to_string();
    let mut command = Command::new(python);
    command.args(["-c", UNEVEN, &port]).arg(&pem).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut client = command.spawn().unwrap();
    let mut stream = DuplexStream::with_tls(listener.accept().unwrap().0, Arc::clone(certificate.config())).unwrap();
    let mut first = [0; 1 << 10];
    stream.read_exact(&mut first).unwrap();
    let mut writing = stream.clone();
    let writer = std::thread::spawn(move || writing.write_all(&vec![7; MANY]).unwrap());
    let mut rest = vec![1; (1 << 20) - first.len()];
    stream.read_exact(&mut rest).unwrap();
    assert!(rest.iter().all(|byte| *byte == 0));
    // More than the system keeps for who does not read.
    assert!(!writer.is_finished());
    client.stdin.take().unwrap().write_all(b"go\n").unwrap();
    writer.join().unwrap();
    // Who waits for more is let go.
    let mut waiting = stream.clone();
    let reader = std::thread::spawn(move || waiting.read(&mut [0]).is_ok_and(|count| count > 0));
    stream.close();
    assert!(!reader.join().unwrap());
    let mut count = String::new();
    client.stdout.take().unwrap().read_to_string(&mut count).unwrap();
    assert_eq!(count.trim(), MANY.to_string());
    assert!(client.wait().unwrap().success());
}

#[test]
fn what_cannot_be_served_with_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let make = |name: &str, host: &str| {
        Certificate::make_file(&file(name), &Host::parse(host).unwrap()).unwrap();
        std::fs::read_to_string(file(name)).unwrap()
    };
    let one = make("one.pem", "127.0.0.1");
    make("other.pem", "127.0.0.1");
    make("elsewhere.pem", "bench.local");
    let (certificate, key) = one.split_at(one.find("-----BEGIN PRIVATE KEY").unwrap());
    std::fs::write(file("certificate.pem"), certificate).unwrap();
    std::fs::write(file("key.pem"), key).unwrap();
    std::fs::write(file("damaged.pem"), &one[..300]).unwrap();
    std::fs::write(file("empty.pem"), "").unwrap();
    let ca = certificate.replacen("MII", "MIJ", 1) + key;
    std::fs::write(file("wrong.pem"), ca).unwrap();
    let mut all = Vec::new();
    for args in [
        &["--certificate", "certificate.pem"][..],
        &["--certificate", "key.pem"],
        &["--certificate", "damaged.pem"],
        &["--certificate", "empty.pem"],
        &["--certificate", "wrong.pem"],
        &["--certificate", "elsewhere.pem"],
        &["--certificate", "one.pem", "--key", "other.pem"],
        &["--certificate", "none.pem", "--key", "key.pem"],
        &["--certificate", "one.pem", "--key", "none.pem"],
        &["--certificate", "nowhere/new.pem"],
        &["--certificate", "."],
    ] {
        let begin = ["teach", "pick_and_place", "--live", "--no-open", "--host", "127.0.0.1"];
        let output = teachtree_in(folder.path(), &[&begin, args].concat());
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        all.push(complained(&output));
    }
    for args in [
        &["--live", "--host", "0.0.0.0"][..],
        &["--live", "--host", "192.168.1.5:8000"],
        &["--live", "--host", "https://bench.local"],
        &["--live", "--host", "203.0.113.77"],
        &["--live", "--host", "bench.local", "--behind", "https://teach.example.org"],
        &["--live", "--certificate", "one.pem"],
        &["--live", "--host", "127.0.0.1", "--key", "key.pem"],
        &["pick_and_place", "-o", "x.csv", "--host", "127.0.0.1"],
    ] {
        let output = teachtree_in(folder.path(), &[&["teach", "pick_and_place"], args].concat());
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        all.push(complained(&output));
    }
    assert!(!file("none.pem").exists());
    insta::assert_snapshot!(all.join("\n"));
}
