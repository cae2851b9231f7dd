const ROSLIB = require('roslib');
const ros = new ROSLIB.Ros({ url: process.argv[2] });
ros.on('connection', () => {
  const l = new ROSLIB.Topic({ ros, name: '/turtle1/pose', messageType: 'turtlesim/msg/Pose' });
  l.subscribe((m) => { l.unsubscribe(); console.log(JSON.stringify(['pose', m.x.toFixed(3)]));
    ros.getTopics((t) => { console.log(JSON.stringify(['topics', t.topics.includes('/turtle1/pose')]));
      const s = new ROSLIB.Service({ ros, name: '/turtle1/set_pen', serviceType: 'turtlesim/SetPen' });
      s.callService(new ROSLIB.ServiceRequest({ r: 1 }), (r) => { console.log(JSON.stringify(['service', r]));
        const t = new ROSLIB.Topic({ ros, name: '/turtle1/cmd_vel', messageType: 'geometry_msgs/Twist' });
        t.publish(new ROSLIB.Message({ linear: { x: 0.5 } }));
        setTimeout(() => { ros.close(); process.exit(0); }, 200); }, (e) => { console.log('fail', e); process.exit(1); }); }, console.log); });
});
ros.on('error', (e) => { console.log('error', e); process.exit(1); });
