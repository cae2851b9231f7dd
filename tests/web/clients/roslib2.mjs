import * as ROSLIB from 'roslib';
const ros = new ROSLIB.Ros({ url: process.argv[2] });
await new Promise((ok, no) => { ros.on('connection', ok); ros.on('error', no); });
const within = (p) => Promise.race([p, new Promise((_, no) => setTimeout(() => no(new Error('late')), 20000))]);
const say = (k, v) => console.log(JSON.stringify([k, v]));
for (const compression of ['none', 'png', 'cbor', 'cbor-raw']) {
  const topic = new ROSLIB.Topic({ ros, name: '/turtle1/pose', messageType: 'turtlesim/msg/Pose', compression, throttle_rate: 50 });
  const m = await within(new Promise((ok) => topic.subscribe(ok)));
  topic.unsubscribe();
  say(compression, compression === 'cbor-raw' ? m.bytes.length : m.x > 5);
}
say('topics', (await within(new Promise((ok, no) => ros.getTopics(ok, no)))).topics.includes('/turtle1/pose'));
say('nodes', (await within(new Promise((ok, no) => ros.getNodes(ok, no)))).includes('/turtlesim'));
say('message_details', (await within(new Promise((ok, no) => ros.getMessageDetails('geometry_msgs/Twist', ok, no)))).length);
const spawn = new ROSLIB.Service({ ros, name: '/spawn', serviceType: 'turtlesim/srv/Spawn' });
const name = 'js' + Date.now();
say('service', (await within(new Promise((ok, no) => spawn.callService({ x: 1, y: 2, theta: 0, name }, ok, no)))).name === name);
const lamp = new ROSLIB.Service({ ros, name: '/js_lamp', serviceType: 'std_srvs/srv/SetBool' });
lamp.advertise((req, res) => { res.success = req.data; res.message = 'on'; return true; });
const call = new ROSLIB.Service({ ros, name: '/js_lamp', serviceType: 'std_srvs/srv/SetBool' });
say('offered', (await within(new Promise((ok, no) => call.callService({ data: true }, ok, no)))).message);
const action = new ROSLIB.Action({ ros, name: '/turtle1/rotate_absolute', actionType: 'turtlesim/action/RotateAbsolute' });
let feedback = 0;
const result = await within(new Promise((ok, no) => action.sendGoal({ theta: 0.3 }, ok, () => { feedback += 1; }, no)));
say('action', [feedback > 0, typeof result.delta]);
const param = new ROSLIB.Param({ ros, name: '/turtlesim:background_r' });
say('param', await within(new Promise((ok, no) => param.get(ok, no))));
ros.close();
process.exit(0);
