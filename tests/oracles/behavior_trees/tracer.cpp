// Ticks and halts trees of BehaviorTree.CPP and Nav2 as their scripts say, and writes down what happened.
// Reads the cases of goldens.py as JSON on stdin, writes them with their traces on stdout.
#include <iostream>
#include <string>
#include <vector>

#include "behaviortree_cpp/bt_factory.h"
#include "behaviortree_cpp/contrib/json.hpp"
#include "nav2_behavior_tree/plugins/control/nonblocking_sequence.hpp"
#include "nav2_behavior_tree/plugins/control/persistent_sequence.hpp"
#include "nav2_behavior_tree/plugins/control/pipeline_sequence.hpp"
#include "nav2_behavior_tree/plugins/control/recovery_node.hpp"
#include "nav2_behavior_tree/plugins/control/round_robin_node.hpp"
#include "nav2_behavior_tree/plugins/decorator/rate_controller.hpp"
#include "nav2_behavior_tree/plugins/decorator/single_trigger_node.hpp"

namespace {

using BT::NodeStatus;

std::vector<std::string> events;

char letter(NodeStatus status) {
  switch (status) {
    case NodeStatus::SUCCESS: return 'S';
    case NodeStatus::FAILURE: return 'F';
    case NodeStatus::RUNNING: return 'R';
    case NodeStatus::SKIPPED: return '-';
    default: return '.';
  }
}

NodeStatus status_of(char c) {
  switch (c) {
    case 'S': return NodeStatus::SUCCESS;
    case 'F': return NodeStatus::FAILURE;
    case 'R': return NodeStatus::RUNNING;
    default: return NodeStatus::SKIPPED;
  }
}

// Answers the letters of its word one tick after the other, over and over.
class Leaf : public BT::ActionNodeBase {
 public:
  Leaf(const std::string& name, const BT::NodeConfig& config) : ActionNodeBase(name, config) {}
  static BT::PortsList providedPorts() { return {BT::InputPort<std::string>("say")}; }

  NodeStatus tick() override {
    const auto say = getInput<std::string>("say").value();
    const char answer = say[ticks_++ % say.size()];
    events.push_back(name() + answer);
    return status_of(answer);
  }

  // Tree::haltTree calls this on every node, once more after the halt went down the tree.
  void halt() override {
    if (status() == NodeStatus::RUNNING) events.push_back(name() + "!");
  }

 private:
  std::size_t ticks_ = 0;
};

nlohmann::json trace(BT::BehaviorTreeFactory& factory, const std::string& xml, const std::string& script) {
  // A fresh blackboard each time; PersistentSequence wants its entry to be there.
  auto blackboard = BT::Blackboard::create();
  blackboard->set("place", 0);
  factory.clearRegisteredBehaviorTrees();
  factory.registerBehaviorTreeFromText(xml);
  auto tree = factory.createTree("Main", blackboard);
  auto steps = nlohmann::json::array();
  for (const char step : script) {
    events.clear();
    std::string said = "h";
    if (step == 't') said = letter(tree.tickOnce()); else tree.haltTree();
    std::string happened, statuses;
    for (const auto& event : events) happened += (happened.empty() ? "" : " ") + event;
    tree.applyVisitor([&](const BT::TreeNode* node) { statuses += letter(node->status()); });
    steps.push_back({said, happened, statuses});
    std::chrono::scripted_clock::time += std::chrono::milliseconds(100);
  }
  return steps;
}

}  // namespace

int main() {
  using namespace nav2_behavior_tree;
  BT::BehaviorTreeFactory factory;
  factory.registerNodeType<Leaf>("Leaf");
  factory.registerNodeType<PipelineSequence>("PipelineSequence");
  factory.registerNodeType<RecoveryNode>("RecoveryNode");
  factory.registerNodeType<RoundRobinNode>("RoundRobin");
  factory.registerNodeType<NonblockingSequence>("NonblockingSequence");
  factory.registerNodeType<PersistentSequenceNode>("PersistentSequence");
  factory.registerNodeType<RateController>("RateController");
  factory.registerNodeType<SingleTrigger>("SingleTrigger");
  auto cases = nlohmann::json::parse(std::cin);
  for (auto& one : cases) {
    try {
      one["trace"] = trace(factory, one["xml"], one["script"]);
    } catch (const std::exception&) {  // a tree that it refuses, such as an IfThenElse over a skipped condition
      one["trace"] = nullptr;
    }
  }
  std::cout << cases << "\n";
}
