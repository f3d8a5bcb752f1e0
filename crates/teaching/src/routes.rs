//! The HTTP routes: the files of the page, the scene, the results of the robot, and the WebSocket.

use super::shared_state::{Teaching, lock};
use super::socket;
use serde_json::{Value, json};
use std::sync::Arc;
use teachtree_base::pose::pose_array;
use teachtree_base::scene::{Part, Role, Shape};
use teachtree_report::page;
use teachtree_serve::duplex_stream::DuplexStream;
use teachtree_serve::{Content, Page, Request, Response};

/// The modules of the page, by name.
const MODULES: [(&str, &str); 9] = [
    ("teach.js", include_str!("page/teach.js")),
    ("socket.js", include_str!("page/socket.js")),
    ("space.js", include_str!("page/space.js")),
    ("draw.js", include_str!("page/draw.js")),
    ("hands.js", include_str!("page/hands.js")),
    ("pad.js", include_str!("page/pad.js")),
    ("show.js", include_str!("page/show.js")),
    ("headset.js", include_str!("page/headset.js")),
    ("camera.js", include_str!("page/camera.js")),
];

/// Teaching as a page.
pub struct TeachingPage(pub Arc<Teaching>);

impl Page for TeachingPage {
    const COMMAND: &'static str = "teach --live";

    fn compiles(&self) -> bool {
        self.0.options.camera.is_some()
    }

    fn answer(&self, _request: &Request, path: &str, changes: bool) -> Response {
        let text = |kind, text: &str| Response { status: 200, kind, content: Content::Bytes(text.as_bytes().to_vec()) };
        let nothing = || Response::refused(404, "there is nothing at this address");
        if changes {
            return nothing();
        }
        let robot = |of: fn((String, String)) -> String| lock(&self.0.takes).page().map(of);
        match path {
            "" => text("text/html; charset=utf-8", include_str!("page/index.html")),
            "style.css" => {
                text("text/css; charset=utf-8", &format!("{}\n{}", page::STYLE, include_str!("page/teach.css")))
            }
            "robot.html" => {
                robot(|(page, _)| page).map_or_else(nothing, |page| text("text/html; charset=utf-8", &page))
            }
            "robot.css" => {
                robot(|(_, style)| style).map_or_else(nothing, |style| text("text/css; charset=utf-8", &style))
            }
            "api/scene" => Response::json(&scene(&self.0)),
            "api/robot" => {
                let replay = lock(&self.0.takes).replay();
                replay.map_or_else(nothing, |replay| Response::json(&replay))
            }
            _ => {
                let of_camera = || self.0.options.camera.as_ref()?.file(path.strip_prefix("camera/")?);
                let module = MODULES.iter().find(|(known, _)| *known == path);
                let module = module.map(|(_, module)| text("text/javascript; charset=utf-8", module));
                module.or_else(of_camera).unwrap_or_else(nothing)
            }
        }
    }

    fn socket_accept(&self, path: &str, key: &str) -> Option<String> {
        (path == "live").then(|| socket::accept(key))
    }

    fn socket(&self, stream: DuplexStream, read: Vec<u8>) {
        socket::serve(stream, read, &self.0);
    }
}

/// Returns the scene as the page draws it.
fn scene(teaching: &Teaching) -> Value {
    let scene = &teaching.options.scene;
    let bodies = scene.bodies.iter().map(|(name, body)| {
        let role = match body.role {
            Role::Object => "object",
            Role::Support => "support",
            Role::Wall => "wall",
            Role::Socket => "socket",
        };
        json!({ "name": name, "role": role, "pose": pose_array(&body.pose()), "parts": body.parts.iter().map(part).collect::<Vec<_>>() })
    });
    let hands = scene.hands.iter().map(|(side, hand)| {
        let fingers: Vec<&str> = hand.fingers.iter().map(|finger| finger.name()).collect();
        json!({ "side": side.name(), "fingers": fingers, "radius": hand.tip_radius.0 })
    });
    json!({ "name": teaching.options.name, "bodies": bodies.collect::<Vec<_>>(), "hands": hands.collect::<Vec<_>>(),
        "camera": teaching.options.camera.is_some() })
}

fn part(part: &Part) -> Value {
    let (shape, size) = match part.shape {
        Shape::Box(edges) => ("box", edges.map(|edge| edge.0).to_vec()),
        Shape::Cylinder(sizes) => ("cylinder", sizes.map(|size| size.0).to_vec()),
        Shape::Ball(radius) => ("ball", vec![radius.0]),
    };
    json!({ "shape": shape, "size": size, "at": part.at.map(|length| length.0), "turned": part.turned })
}
