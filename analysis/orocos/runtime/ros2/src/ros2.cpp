#include "mauve/ros2.hpp"

#include <dds/dds.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <deque>
#include <iostream>
#include <map>
#include <mutex>
#include <new>
#include <set>
#include <stdexcept>

#include "domain.hpp"
#include "samples.hpp"

namespace mauve {
namespace {

// Without what ROS 2 may have, the hash of Jazzy and later: earlier ones compare none.
const char discovery_hash[] = "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e";
const char discovery_type[] = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";

// Greater sizes are none for Cyclone.
constexpr std::size_t greatest_size = 2000000000;

// Another host may start a little later: it is missed after so many looks, two a second. Of one that comes and goes, this often.
constexpr int patient_looks = 4, most_said = 100;

// More endpoints of others are looked at later.
constexpr std::uint32_t looked_at_once = 16;

// The system suspends all real-time threads of a CPU that has no time for others. Before that, the threads of Cyclone lose their priority:
// where they use more than this part of the CPU, in percent, until they use less than the other.
constexpr Nanoseconds flood_length = 100000000, flood_begin = 70, flood_end = 40;

// What ROS 2 calls rmw_dds_common/msg/ParticipantEntitiesInfo: which endpoints are whose node's.
typedef std::array<std::uint8_t, 16> Gid;

struct NodeInfo {
  std::string space, name;
  std::vector<Gid> readers, writers;
};

struct ParticipantInfo {
  Gid gid;
  std::vector<NodeInfo> nodes;
};

template <class Stream>
void visit(Stream& stream, NodeInfo& info) {
  stream(info.space, 256);
  stream(info.name, 256);
  stream(info.readers);
  stream(info.writers);
}

template <class Stream>
void visit(Stream& stream, ParticipantInfo& info) {
  stream(info.gid);
  stream(info.nodes);
}

// What Cyclone says of its errors.
struct Complaints {
  std::mutex mutex;
  std::string last;
};

Complaints& complaints() {
  static Complaints* const all = new Complaints();
  return *all;
}

void note_complaint(void*, const dds_log_data_t* data) {
  const std::unique_lock<std::mutex> lock(complaints().mutex, std::try_to_lock);
  // A peer's samples that cannot be used are counted.
  if (!lock || std::strstr(data->message, "deserialization") != nullptr) return;
  // Without the bytes of a packet.
  complaints().last.assign(data->message, std::find(data->message, data->message + data->size, '<'));
  while (!complaints().last.empty() && complaints().last.back() <= ' ') complaints().last.pop_back();
}

std::string taken_complaint() {
  const std::lock_guard<std::mutex> lock(complaints().mutex);
  std::string taken;
  taken.swap(complaints().last);
  return taken;
}

struct Deleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
typedef std::unique_ptr<dds_qos_t, Deleter> Qos;

Qos endpoint_qos(int depth, bool is_reliable, bool is_transient_local, const std::string& hash) {
  Qos qos(dds_create_qos());
  const dds_data_representation_id_t representation = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos.get(), 1, &representation);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  // A write never waits.
  dds_qset_reliability(qos.get(), is_reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(qos.get(), is_transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (is_transient_local) {
    const std::int32_t unlimited = DDS_LENGTH_UNLIMITED;
    dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, depth, unlimited, unlimited, unlimited);
  }
  dds_qset_writer_data_lifecycle(qos.get(), false);
  const std::string data = "typehash=" + hash + ";";
  dds_qset_userdata(qos.get(), data.data(), data.size());
  return qos;
}

Gid gid_of(dds_entity_t entity) {
  dds_guid_t guid = {};
  dds_get_guid(entity, &guid);
  Gid gid;
  std::copy(std::begin(guid.v), std::end(guid.v), gid.begin());
  return gid;
}

// The hash that an endpoint of another says, or nothing.
std::string hash_in(const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &data, &size) || data == nullptr) return "";
  const std::string text(static_cast<const char*>(data), size);
  dds_free(data);
  const std::size_t begin = text.find("typehash=");
  if (begin == std::string::npos) return "";
  return text.substr(begin + 9, text.find(';', begin) - begin - 9);
}

// What strangers call their types is shown.
std::string printable(const char* text) {
  std::string out = text == nullptr ? "" : std::string(text).substr(0, 200);
  for (char& c : out) c = c >= ' ' && c < 127 ? c : '?';
  return out;
}

// A number that its thread alone changes, and others read.
struct Count {
  std::atomic<std::uint64_t> value{0};
  void add(std::uint64_t more) { value.store(value.load(std::memory_order_relaxed) + more, std::memory_order_relaxed); }
  operator std::uint64_t() const { return value.load(std::memory_order_relaxed); }
};

// A topic of DDS, which several ports may share.
struct SharedTopic {
  explicit SharedTopic(std::size_t max_bytes) { arrivals.max_bytes = max_bytes; }
  dds_entity_t entity = 0;
  const ddsi_sertype* type = nullptr;
  std::string type_name;
  Arrivals arrivals{};
};

struct Endpoint {
  Endpoint(const Ros2::Topic& of, std::unique_ptr<Ros2::Port> from) : topic(of), access("ros2." + of.key), port(std::move(from)) {}
  const Ros2::Topic topic;
  const std::string access;
  const std::unique_ptr<Ros2::Port> port;
  SharedTopic* shared = nullptr;
  dds_entity_t entity = 0;
  std::uint64_t last_number = 0;
  Count moved, too_large, malformed, overwritten, refused;
  std::uint32_t peers = 0;
  // Of a connection between hosts: how many looks it may still be without its other end; whether that is missed, and how often it was.
  int patience = patient_looks, times_missed = 0;
  bool is_missed = false;
};

// How many endpoints of others have been matched so far, how many are there, how many have another QoS, and the policy of the last one.
struct Seen {
  std::uint32_t peers, present, refused, policy;
};

Seen seen_by(const Endpoint& endpoint) {
  if (endpoint.port->is_published()) {
    dds_publication_matched_status_t matched = {};
    dds_offered_incompatible_qos_status_t other = {};
    dds_get_publication_matched_status(endpoint.entity, &matched);
    dds_get_offered_incompatible_qos_status(endpoint.entity, &other);
    return {matched.total_count, matched.current_count, other.total_count, other.last_policy_id};
  }
  dds_subscription_matched_status_t matched = {};
  dds_requested_incompatible_qos_status_t other = {};
  dds_get_subscription_matched_status(endpoint.entity, &matched);
  dds_get_requested_incompatible_qos_status(endpoint.entity, &other);
  return {matched.total_count, matched.current_count, other.total_count, other.last_policy_id};
}

// The other end of a connection between hosts.
std::string other_end(const Endpoint& endpoint) {
  return (endpoint.port->is_published() ? "subscription (" : "publisher (") + endpoint.topic.other_end + ")";
}

// Says once that the other end is not there, and once that it is.
void look_for_other_end(Endpoint& endpoint, bool is_there) {
  if (endpoint.topic.other_end.empty()) return;
  const bool was_missed = endpoint.is_missed;
  if (is_there) {
    endpoint.patience = 0;
    endpoint.is_missed = false;
  } else if (!was_missed && endpoint.patience-- <= 0) {
    endpoint.is_missed = true;
    ++endpoint.times_missed;
  }
  if (endpoint.is_missed == was_missed || endpoint.times_missed > most_said) return;
  std::cerr << (is_there ? endpoint.topic.key + ": there is a " : "warning: " + endpoint.topic.key + ": no ") + other_end(endpoint) + "\n"
            << std::flush;
}

}  // namespace

struct Ros2::State {
  explicit State(Robot& of, const std::string& in, const std::string& called)
      : robot(of), space(in.empty() ? "/" : in), node(called) {}

  void create();
  SharedTopic& shared(const Topic& topic);
  dds_entity_t checked(dds_entity_t entity, const std::string& what) const;
  dds_entity_t create_topic(const std::string& name, ddsi_sertype*& type) const;
  void announce();
  void watch_load();
  void publish(Endpoint& endpoint);
  void subscribe(Endpoint& endpoint);
  void look_at_peers(dds_entity_t reader, bool are_writers, std::vector<std::string>& found);
  void compare(const Endpoint& endpoint, const dds_builtintopic_endpoint_t& peer, std::vector<std::string>& found) const;

  Robot& robot;
  const std::string space, node;
  int domain_id = 0;
  Discovery discovery = Localhost;
  MiddlewareScheduling scheduling = {0, Cpus()};
  std::string xml;
  std::deque<Endpoint> endpoints;
  std::map<std::string, std::unique_ptr<SharedTopic>> topics;
  std::set<std::string> threads, said;
  // The numbers of Cyclone's threads, and what the gateway has seen of them last.
  std::vector<int> workers;
  Nanoseconds watched_at = 0, used = 0;
  std::atomic<bool> is_flooded{false};
  SharedTopic nodes{0};
  dds_entity_t domain = 0, participant = 0, publications = 0, subscriptions = 0;
};

Ros2::Ros2(Robot& robot, const std::string& space, const std::string& node) : state_(new State(robot, space, node)) {}
Ros2::~Ros2() { close(); }

Ros2::TypeName::TypeName(const dds_topic_descriptor* of) : name(of->m_typename) {}

void Ros2::domain(int number) { state_->domain_id = number; }
void Ros2::discovery(Discovery discovery) { state_->discovery = discovery; }

void Ros2::gateway(std::int64_t period, int priority, const Cpus& cpus, std::int64_t deadline, std::int64_t response,
                   const std::string& name) {
  state_->scheduling = {std::max(priority - 1, 0), cpus};
  state_->robot.gateway(*this, name, period, priority, cpus, deadline, response);
}

void Ros2::add(const Topic& topic, std::unique_ptr<Port> port) { state_->endpoints.emplace_back(topic, std::move(port)); }

std::vector<Gateway::End> Ros2::ends() {
  std::vector<End> ends;
  for (Endpoint& it : state_->endpoints) {
    ends.push_back({it.topic.instance, it.topic.port, &it.port->end(), it.port->is_published(), it.topic.depth > 1 ? it.topic.depth : 0});
  }
  return ends;
}

bool Ros2::has_thread(const std::string& name) const { return state_->threads.count(name) > 0; }

std::string Ros2::absence() const { return "no topics of ROS 2 with --simulate-time: nobody outside is on the virtual clock"; }

void Ros2::open(bool allows_non_realtime) {
  State& state = *state_;
  const int number = domain_number(state.domain_id);
  if (allows_non_realtime && state.scheduling.priority > 0 && !may_have_priority(state.scheduling.priority)) state.scheduling.priority = 0;
  std::size_t unsent = 1000000, largest = 0;
  for (const Endpoint& it : state.endpoints) {
    largest = std::max(largest, it.topic.max_bytes);
    unsent += 2 * it.topic.max_bytes * static_cast<std::size_t>(std::max(1, it.topic.depth));
  }
  largest = std::min(largest, greatest_size / 2);
  state.xml = configuration(state.discovery, state.scheduling.priority, std::min(unsent, greatest_size), largest);
  dds_set_log_sink(note_complaint, nullptr);
  dds_set_log_mask(DDS_LC_FATAL | DDS_LC_ERROR | DDS_LC_WARNING);
  state.domain_id = number;
  const std::set<int> started = confined(state.scheduling.cpus, [&state] { state.create(); });
  for (const int thread : started) {
    const std::string name = name_of_thread(thread);
    state.threads.insert(name);
    state.workers.push_back(thread);
    const std::string differs = difference(thread, state.scheduling);
    if (!differs.empty() && !allows_non_realtime) {
      throw std::runtime_error("thread " + name + " of Cyclone DDS " + differs +
                               ": CYCLONEDDS_URI must not set its threads; with --allow-non-realtime the response times do not hold");
    }
  }
}

dds_entity_t Ros2::State::checked(dds_entity_t entity, const std::string& what) const {
  if (entity >= 0) return entity;
  const std::string complaint = taken_complaint();
  throw std::runtime_error(what + " cannot be created: " + (complaint.empty() ? dds_strretcode(entity) : complaint) +
                           (discovery == Localhost ? "; is the loopback interface `lo` up, and CYCLONEDDS_URI right?"
                                                   : "; is a network interface up, and CYCLONEDDS_URI right?"));
}

// Exchanges the type for the one that Cyclone uses.
dds_entity_t Ros2::State::create_topic(const std::string& name, ddsi_sertype*& type) const {
  return checked(dds_create_topic_sertype(participant, name.c_str(), &type, nullptr, nullptr, nullptr), "topic " + name);
}

SharedTopic& Ros2::State::shared(const Topic& topic) {
  std::unique_ptr<SharedTopic>& made = topics[topic.name];
  const std::string& type_name = topic.type.name;
  if (made) {
    if (made->type_name == type_name) return *made;
    throw std::runtime_error("topic " + topic.name + " has two types, " + made->type_name + " and " + type_name +
                             ": give one of its ports another name in [ros2] topics");
  }
  made.reset(new SharedTopic(0));
  made->type_name = type_name;
  for (const Endpoint& it : endpoints) {
    if (it.topic.name == topic.name) made->arrivals.max_bytes = std::max(made->arrivals.max_bytes, it.topic.max_bytes);
  }
  ddsi_sertype* type = new_sample_type(type_name.c_str(), made->arrivals);
  made->entity = create_topic("rt" + topic.name, type);
  made->type = type;
  return *made;
}

// In a thread with the CPUs of the gateway.
void Ros2::State::create() {
  const std::string domain_name = "domain " + std::to_string(domain_id) + " of ROS 2";
  const auto open_domain = [&] {
    domain = checked(dds_create_domain(static_cast<dds_domainid_t>(domain_id), xml.c_str()), domain_name);
  };
  if (discovery == Localhost && !has_own_interface()) {
    on_loopback(open_domain);
  } else {
    open_domain();
  }
  const Qos qos(dds_create_qos());
  const std::string enclave = "enclave=/;";
  dds_qset_userdata(qos.get(), enclave.data(), enclave.size());
  participant = dds_create_participant(static_cast<dds_domainid_t>(domain_id), qos.get(), nullptr);
  checked(participant, "the participant in " + domain_name);
  const std::string what = "a reader of the endpoints in " + domain_name;
  publications = checked(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr), what);
  subscriptions = checked(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, nullptr, nullptr), what);
  for (Endpoint& it : endpoints) {
    it.shared = &shared(it.topic);
    const Qos own = endpoint_qos(it.topic.depth, it.topic.is_reliable, it.topic.is_transient_local, it.topic.hash);
    it.entity = it.port->is_published()
                    ? checked(dds_create_writer(participant, it.shared->entity, own.get(), nullptr), "a publisher of " + it.topic.name)
                    : checked(dds_create_reader(participant, it.shared->entity, own.get(), nullptr), "a subscription of " + it.topic.name);
  }
  announce();
}

// Says whose endpoints they are.
void Ros2::State::announce() {
  ParticipantInfo info = {gid_of(participant), {{space, node, {}, {}}}};
  NodeInfo& own = info.nodes[0];
  for (const Endpoint& it : endpoints) (it.port->is_published() ? own.writers : own.readers).push_back(gid_of(it.entity));
  ddsi_sertype* type = new_sample_type(discovery_type, nodes.arrivals);
  const dds_entity_t topic = create_topic("ros_discovery_info", type);
  const Qos qos = endpoint_qos(1, true, true, discovery_hash);
  const dds_entity_t writer = checked(dds_create_writer(participant, topic, qos.get(), nullptr), "a publisher of ros_discovery_info");
  const std::size_t size = cdr::size(info);
  ddsi_serdata* const sample = size == 0 ? nullptr : new_sample(type, size);
  if (sample == nullptr) throw std::runtime_error("the name of node " + node + " is too long: ROS 2 allows 256 characters");
  cdr::write(info, bytes_of(sample));
  checked(dds_writecdr(writer, sample), "the announcement of node " + node);
}

void Ros2::State::watch_load() {
  const Nanoseconds at = now(), length = at - watched_at;
  if (scheduling.priority == 0 || length < flood_length) return;
  Nanoseconds sum = 0;
  for (const int thread : workers) sum += cpu_of(thread);
  const Nanoseconds share = watched_at == 0 ? 0 : 100 * (sum - used) / length;
  watched_at = at;
  used = sum;
  if (is_flooded ? share >= flood_end : share <= flood_begin) return;
  is_flooded = !is_flooded;
  for (const int thread : workers) set_priority(thread, is_flooded ? 0 : scheduling.priority);
}

bool Ros2::step() {
  state_->watch_load();
  for (Endpoint& it : state_->endpoints) it.port->is_published() ? state_->publish(it) : state_->subscribe(it);
  return true;
}

void Ros2::State::publish(Endpoint& endpoint) {
  for (int count = 0; count < endpoint.topic.depth; ++count) {
    PortAccess access(endpoint.access.c_str(), false);
    if (!endpoint.port->take()) return access.cancel();
    const std::uint64_t number = endpoint.port->number();
    access.end(Outcome::NewData, number);
    if (number > endpoint.last_number) endpoint.overwritten.add(number - endpoint.last_number - 1);
    endpoint.last_number = number;
    const std::size_t size = endpoint.port->size();
    ddsi_serdata* const sample = size == 0 || size > endpoint.topic.max_bytes ? nullptr : new_sample(endpoint.shared->type, size);
    if (sample == nullptr) {
      endpoint.too_large.add(1);
      continue;
    }
    endpoint.port->write(bytes_of(sample));
    (dds_writecdr(endpoint.entity, sample) == DDS_RETCODE_OK ? endpoint.moved : endpoint.refused).add(1);
  }
}

void Ros2::State::subscribe(Endpoint& endpoint) {
  for (int count = 0; count < endpoint.topic.depth; ++count) {
    PortAccess access(endpoint.access.c_str(), false);
    ddsi_serdata* sample = nullptr;
    dds_sample_info_t info;
    if (dds_takecdr(endpoint.entity, &sample, 1, &info, DDS_ANY_STATE) <= 0) return access.cancel();
    // Otherwise it only says that a publisher has gone.
    bool is_good = !info.valid_data;
    if (info.valid_data) {
      const std::size_t size = size_of_sample(sample);
      try {
        if (size > endpoint.topic.max_bytes) {
          endpoint.too_large.add(1);
        } else {
          is_good = endpoint.port->deliver(bytes_of(sample), size, endpoint.topic.max_bytes);
          (is_good ? endpoint.moved : endpoint.malformed).add(1);
        }
      } catch (const std::bad_alloc&) {
        endpoint.too_large.add(1);
      }
    }
    ddsi_serdata_unref(sample);
    if (info.valid_data && is_good) {
      access.end(Outcome::Written, endpoint.port->number());
    } else {
      access.cancel();
    }
  }
}

void Ros2::State::compare(const Endpoint& endpoint, const dds_builtintopic_endpoint_t& peer, std::vector<std::string>& found) const {
  const bool is_ours_published = endpoint.port->is_published();
  const std::string kind = is_ours_published ? "subscription" : "publisher";
  const std::string whose = "topic " + endpoint.topic.name + ": a " + kind + " of another program ";
  const std::string ours = endpoint.topic.key;
  if (endpoint.shared->type_name != peer.type_name) {
    found.push_back(whose + "has type " + printable(peer.type_name) + ", and " + ours + " has " + endpoint.shared->type_name +
                    ": they exchange nothing; give one of them another topic");
    return;
  }
  const std::string hash = hash_in(peer.qos);
  if (!hash.empty() && hash != endpoint.topic.hash) {
    found.push_back(whose + "has another definition of " + endpoint.shared->type_name + " (" + printable(hash.c_str()) + " instead of " +
                    endpoint.topic.hash + "): samples may be malformed; use the same .msg file for both");
  }
  dds_reliability_kind_t reliability = DDS_RELIABILITY_BEST_EFFORT;
  dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE;
  dds_duration_t ignored = 0;
  dds_qget_reliability(peer.qos, &reliability, &ignored);
  dds_qget_durability(peer.qos, &durability);
  const bool is_reliable = reliability == DDS_RELIABILITY_RELIABLE, is_kept = durability != DDS_DURABILITY_VOLATILE;
  const auto is_refused = [&](bool own, bool other) { return is_ours_published ? other && !own : own && !other; };
  const auto differ = [&](const std::string& offer, const std::string& wish, const std::string& key) {
    found.push_back(whose + (is_ours_published ? "wants " + wish + ", and " + ours + " offers " + offer
                                               : "offers " + offer + ", and " + ours + " wants " + wish) +
                    ": they exchange nothing; set " + key + " of this topic in [ros2] topics, or the QoS of the other program");
  };
  if (is_refused(endpoint.topic.is_reliable, is_reliable)) differ("best-effort", "reliable", "`reliability`");
  if (is_refused(endpoint.topic.is_transient_local, is_kept)) differ("volatile", "transient-local", "`durability`");
}

void Ros2::State::look_at_peers(dds_entity_t reader, bool are_writers, std::vector<std::string>& found) {
  void* samples[looked_at_once] = {};
  dds_sample_info_t infos[looked_at_once];
  const dds_return_t count = dds_take(reader, samples, infos, looked_at_once, looked_at_once);
  dds_guid_t own = {};
  dds_get_guid(participant, &own);
  for (dds_return_t index = 0; index < count; ++index) {
    const auto& peer = *static_cast<const dds_builtintopic_endpoint_t*>(samples[index]);
    if (!infos[index].valid_data || std::memcmp(peer.participant_key.v, own.v, sizeof own.v) == 0) continue;
    for (const Endpoint& it : endpoints) {
      if (it.port->is_published() != are_writers && "rt" + it.topic.name == peer.topic_name) compare(it, peer, found);
    }
  }
  if (count > 0) dds_return_loan(reader, samples, count);
}

void Ros2::look() {
  State& state = *state_;
  std::vector<std::string> found;
  {
    // Threads of Cyclone wait for what this one holds.
    const Scheduled scheduled(state.scheduling);
    state.look_at_peers(state.publications, true, found);
    state.look_at_peers(state.subscriptions, false, found);
    for (Endpoint& it : state.endpoints) {
      const Seen seen = seen_by(it);
      it.peers = seen.peers;
      look_for_other_end(it, seen.present > 0);
      if (seen.refused > 0 && seen.policy != DDS_DURABILITY_QOS_POLICY_ID && seen.policy != DDS_RELIABILITY_QOS_POLICY_ID) {
        found.push_back("topic " + it.topic.name + ": another program differs from " + it.topic.key + " in its QoS (policy " +
                        std::to_string(seen.policy) + " of DDS): they exchange nothing; use ROS 2's default there");
      }
    }
  }
  if (state.is_flooded) {
    found.push_back("other programs send more than the CPUs of the gateway can receive: the threads of Cyclone DDS have no priority "
                    "until that ends, and samples may be late");
  }
  const std::string complaint = taken_complaint();
  if (!complaint.empty()) found.push_back("Cyclone DDS: " + complaint);
  for (const std::string& it : found) {
    // A stranger may have many types.
    if (state.said.size() < 100 && state.said.insert(it).second) std::cerr << "warning: " + it + "\n" << std::flush;
  }
}

void Ros2::close() {
  State& state = *state_;
  for (Endpoint& it : state.endpoints) {
    if (it.entity > 0 && state.participant > 0) it.peers = seen_by(it).peers;
  }
  if (state.participant > 0) dds_delete(state.participant);
  if (state.domain > 0) dds_delete(state.domain);
  state.participant = state.domain = 0;
}

std::string Ros2::report() const {
  std::string out = "topics of ROS 2:\n";
  for (const Endpoint& it : state_->endpoints) {
    const bool is_published = it.port->is_published();
    const std::uint64_t moved = it.moved, malformed = it.malformed, own_too_large = it.too_large;
    const Arrivals* const arrivals = it.shared == nullptr || is_published ? nullptr : &it.shared->arrivals;
    const std::uint64_t came = arrivals == nullptr ? 0 : arrivals->accepted.load();
    const std::uint64_t too_large = own_too_large + (arrivals == nullptr ? 0 : arrivals->too_large.load());
    const std::uint64_t used = moved + malformed + own_too_large;
    const std::uint64_t overwritten = is_published ? it.overwritten : came > used ? came - used : 0;
    out += "  " + it.topic.name + (is_published ? " <- " : " -> ") + it.topic.key + ": " + std::to_string(moved) + " samples, peers: " +
           std::to_string(it.peers);
    if (it.times_missed > 0) {
      out += (it.is_missed ? "; no " : "; was without a ") + other_end(it) + ", " + std::to_string(it.times_missed) + " times";
    }
    const std::pair<std::uint64_t, std::string> dropped[] = {
        {too_large, "greater than max_bytes = " + std::to_string(it.topic.max_bytes)},
        {malformed, "malformed"},
        {overwritten, "overwritten before the gateway read them (a greater depth, or a shorter period of the gateway)"},
        {it.refused, "refused by Cyclone DDS (a slow peer)"}};
    for (const auto& drop : dropped) {
      if (drop.first > 0) out += "; dropped: " + std::to_string(drop.first) + " " + drop.second;
    }
    out += "\n";
  }
  return out;
}

}  // namespace mauve
