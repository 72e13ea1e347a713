// A peer with Fast DDS: sends random samples, and compares what comes back. Fast CDR encodes them, field by field.

#include <fastcdr/Cdr.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <chrono>
#include <iostream>
#include <memory>
#include <random>
#include <thread>

#include "messages.hpp"

using namespace eprosima::fastdds::dds;

namespace {

// Calls Fast CDR for each field.
class Encoder {
 public:
  explicit Encoder(eprosima::fastcdr::Cdr& cdr) : cdr_(cdr) {}
  template <class T>
  typename std::enable_if<std::is_arithmetic<T>::value>::type operator()(T& field, int = 0, int = 0) { cdr_ << field; }
  void operator()(std::string& field, int = 0, int = 0) { cdr_ << field; }
  template <class T, std::size_t size>
  void operator()(std::array<T, size>& field, int = 0, int = 0) { for (T& it : field) (*this)(it); }
  template <class T>
  void operator()(std::vector<T>& field, int = 0, int = 0) {
    cdr_ << static_cast<std::uint32_t>(field.size());
    for (T& it : field) (*this)(it);
  }
  void operator()(std::vector<bool>& field, int = 0, int = 0) {
    cdr_ << static_cast<std::uint32_t>(field.size());
    for (bool it : field) cdr_ << it;
  }
  template <class T>
  typename std::enable_if<std::is_class<T>::value>::type operator()(T& field, int = 0, int = 0) { visit(*this, field); }

 private:
  eprosima::fastcdr::Cdr& cdr_;
};

// The same in the other direction.
class Decoder {
 public:
  explicit Decoder(eprosima::fastcdr::Cdr& cdr) : cdr_(cdr) {}
  template <class T>
  typename std::enable_if<std::is_arithmetic<T>::value>::type operator()(T& field, int = 0, int = 0) { cdr_ >> field; }
  void operator()(std::string& field, int = 0, int = 0) { cdr_ >> field; }
  template <class T, std::size_t size>
  void operator()(std::array<T, size>& field, int = 0, int = 0) { for (T& it : field) (*this)(it); }
  template <class T>
  void operator()(std::vector<T>& field, int = 0, int = 0) {
    field.resize(count());
    for (T& it : field) (*this)(it);
  }
  void operator()(std::vector<bool>& field, int = 0, int = 0) {
    field.resize(count());
    for (std::size_t index = 0; index < field.size(); ++index) {
      bool it = false;
      cdr_ >> it;
      field[index] = it;
    }
  }
  template <class T>
  typename std::enable_if<std::is_class<T>::value>::type operator()(T& field, int = 0, int = 0) { visit(*this, field); }

 private:
  std::uint32_t count() {
    std::uint32_t size = 0;
    cdr_ >> size;
    return size;
  }
  eprosima::fastcdr::Cdr& cdr_;
};

// Sets each field to a random value.
class Filler {
 public:
  explicit Filler(std::mt19937& random) : random_(random) {}
  void operator()(bool& field, std::size_t = 0, std::size_t = 0) { field = random_() % 2 == 0; }
  template <class T>
  typename std::enable_if<std::is_arithmetic<T>::value>::type operator()(T& field, std::size_t = 0, std::size_t = 0) {
    field = static_cast<T>(random_());
  }
  void operator()(std::string& field, std::size_t bound = 0, std::size_t = 0) {
    field.assign(random_() % ((bound == 0 ? 50 : bound) + 1), 'x');
    for (char& c : field) c = static_cast<char>('a' + random_() % 26);
  }
  template <class T, std::size_t size>
  void operator()(std::array<T, size>& field, std::size_t = 0, std::size_t text_bound = 0) { for (T& it : field) (*this)(it, text_bound); }
  template <class T>
  void operator()(std::vector<T>& field, std::size_t bound = 0, std::size_t text_bound = 0) {
    field.resize(random_() % ((bound == 0 ? 8 : bound) + 1));
    for (T& it : field) (*this)(it, text_bound);
  }
  void operator()(std::vector<bool>& field, std::size_t = 0, std::size_t = 0) {
    field.resize(random_() % 8);
    for (std::size_t index = 0; index < field.size(); ++index) field[index] = random_() % 2 == 0;
  }
  template <class T>
  typename std::enable_if<std::is_class<T>::value>::type operator()(T& field, std::size_t = 0, std::size_t = 0) { visit(*this, field); }

 private:
  std::mt19937& random_;
};

std::string encoded(rig::msg::All& message) {
  std::string bytes(8192, '\0');
  eprosima::fastcdr::FastBuffer buffer(&bytes[0], bytes.size());
  eprosima::fastcdr::Cdr cdr(buffer, eprosima::fastcdr::Cdr::LITTLE_ENDIANNESS, eprosima::fastcdr::Cdr::DDS_CDR);
  cdr.serialize_encapsulation();
  Encoder encoder(cdr);
  visit(encoder, message);
  bytes.resize(cdr.getSerializedDataLength());
  return bytes;
}

class Type : public TopicDataType {
 public:
  Type() {
    setName("rig::msg::dds_::All_");
    m_typeSize = 8192;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override {
    const std::string bytes = encoded(*static_cast<rig::msg::All*>(data));
    if (bytes.size() > payload->max_size) return false;
    std::copy(bytes.begin(), bytes.end(), payload->data);
    payload->encapsulation = CDR_LE;
    payload->length = static_cast<std::uint32_t>(bytes.size());
    return true;
  }
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    try {
      eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
      eprosima::fastcdr::Cdr cdr(buffer, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR);
      cdr.read_encapsulation();
      Decoder decoder(cdr);
      visit(decoder, *static_cast<rig::msg::All*>(data));
      return true;
    } catch (const eprosima::fastcdr::exception::Exception&) {
      return false;
    }
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 8192u; };
  }
  void* createData() override { return new rig::msg::All(); }
  void deleteData(void* data) override { delete static_cast<rig::msg::All*>(data); }
  bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
};

// Asks every 10 ms, for 10 s unless said otherwise.
template <class Condition>
bool wait_for(Condition condition, int moments = 1000) {
  for (int moment = 0; moment < moments; ++moment) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

}  // namespace

int main() {
  DomainParticipantQos qos;
  // The loopback alone, without multicast: it asks the first participants there.
  const auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  transport->interfaceWhiteList.push_back("127.0.0.1");
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(transport);
  for (std::uint32_t participant = 0; participant < 8; ++participant) {
    eprosima::fastrtps::rtps::Locator_t locator(LOCATOR_KIND_UDPv4, 7410 + 2 * participant);
    eprosima::fastrtps::rtps::IPLocator::setIPv4(locator, 127, 0, 0, 1);
    qos.wire_protocol().builtin.initialPeersList.push_back(locator);
  }
  DomainParticipant* const participant = DomainParticipantFactory::get_instance()->create_participant(0, qos);
  TypeSupport type(new Type());
  type.register_type(participant);
  DataWriterQos writer_qos;
  writer_qos.history().depth = 10;
  DataReaderQos reader_qos;
  reader_qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
  reader_qos.history().depth = 10;
  Publisher* const publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
  Subscriber* const subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  DataWriter* const writer = publisher->create_datawriter(participant->create_topic("rt/rig/all_in", type.get_type_name(), TOPIC_QOS_DEFAULT), writer_qos);
  DataReader* const reader = subscriber->create_datareader(participant->create_topic("rt/rig/all_out", type.get_type_name(), TOPIC_QOS_DEFAULT), reader_qos);
  const bool is_matched = wait_for([&] {
    PublicationMatchedStatus published;
    SubscriptionMatchedStatus subscribed;
    writer->get_publication_matched_status(published);
    reader->get_subscription_matched_status(subscribed);
    return published.current_count > 0 && subscribed.current_count > 0;
  });
  if (!is_matched) {
    std::cout << "no robot\n";
    return 1;
  }
  std::mt19937 random(52);
  Filler filler(random);
  rig::msg::All sent, back;
  const auto send = [&] {
    visit(filler, sent);
    writer->write(&sent);
  };
  const auto is_taken = [&] {
    SampleInfo info;
    return reader->take_next_sample(&back, &info) == ReturnCode_t::RETCODE_OK && info.valid_data;
  };
  // The robot may know the writer later than the writer knows the robot: what is sent before is lost.
  int early = 0;
  bool is_heard = false;
  for (int attempt = 0; attempt < 20 && !is_heard; ++attempt) {
    send();
    while (!is_heard && wait_for(is_taken, 50)) {
      ++early;
      is_heard = encoded(sent) == encoded(back);
    }
  }
  int same = 0;
  constexpr int count = 100;
  for (int index = 0; index < count; ++index) {
    send();
    wait_for(is_taken);
    if (encoded(sent) == encoded(back)) ++same;
  }
  std::cout << early << " early, " << same << " of " << count << " came back\n";
  participant->delete_contained_entities();
  DomainParticipantFactory::get_instance()->delete_participant(participant);
  return same == count ? 0 : 1;
}
