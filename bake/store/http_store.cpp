// SPDX-License-Identifier: MIT
// See http_store.h.
#include "bake/store/http_store.h"

#include "bake/store/directory_store.h"
#include "bake/store/entry_file.h"
#include "relume/bake/context.h"

#include <curl/curl.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <new>
#include <utility>

namespace relume {
namespace {

constexpr long kConnectMs = 5000;                     // a server that does not answer in this time is not there
constexpr long kSlowBytes = 1024, kSlowSeconds = 20;  // [byte/s] [s] slower than this for so long: given up
constexpr int kPollMs = 100;                          // between two questions whether to go on
constexpr long kFound = 200, kMadeFirst = 200, kMadeLast = 299, kUnauthorized = 401, kNotFound = 404,
               kProxyUnauthorized = 407, kGone = 410, kTooLarge = 413, kFull = 507;
constexpr std::uint64_t kMaxPage = 1u << 20;  // [byte] of what a server says in place of an entry

using Bytes = std::vector<std::byte>;

// A body as it comes in: an entry, or a page of the server's, which is not kept.
struct Received {
  CURL* easy = nullptr;
  bool isWanted = false;
  std::uint64_t maxBytes = 0;
  Bytes bytes;
  std::uint64_t most = std::numeric_limits<std::uint64_t>::max();  // by the header, once it is there
  std::uint64_t ignored = 0;
  Status sound = done();  // an error: no more is taken
};

// Compare what has come, and what the server says will come, with what the header says and with what may be read. Room
// is made for all of it at once.
Status takePart(Received& received, std::span<const std::byte> part) {
  long status = 0;
  curl_easy_getinfo(received.easy, CURLINFO_RESPONSE_CODE, &status);
  if (!received.isWanted || status != kFound) {
    received.ignored += part.size();
    return received.ignored <= kMaxPage ? done() : Status(Error{ErrorCode::io, "the server's page does not end"});
  }
  curl_off_t length = -1;
  curl_easy_getinfo(received.easy, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
  const std::uint64_t had = received.bytes.size(), has = had + part.size();
  const std::uint64_t size = std::max(has, length > 0 ? static_cast<std::uint64_t>(length) : 0);
  if (const Status fits = checkEntrySize(size, received.most, received.maxBytes); !fits) return fits;
  received.bytes.insert(received.bytes.end(), part.begin(), part.end());
  if (had >= kEntryHeaderBytes || has < kEntryHeaderBytes) return done();
  const Result<std::uint64_t> most = mostEntryBytes(received.bytes);
  if (!most) return most.error();
  received.most = *most;
  if (const Status fits = checkEntrySize(size, received.most, received.maxBytes); !fits) return fits;
  received.bytes.reserve(length > 0 ? size : std::min(received.most, received.maxBytes));
  return done();
}

std::size_t receive(char* data, std::size_t one, std::size_t count, void* to) {
  auto& received = *static_cast<Received*>(to);
  try {
    received.sound = takePart(received, std::as_bytes(std::span(data, one * count)));
  } catch (const std::bad_alloc&) {
    received.sound = Error{ErrorCode::memory, "out of memory"};
  }
  return received.sound ? one * count : 0;
}

// What is left to send.
struct Sent {
  std::span<const std::byte> bytes;
  std::size_t at = 0;
};

std::size_t send(char* data, std::size_t one, std::size_t count, void* from) {
  auto& sent = *static_cast<Sent*>(from);
  const std::size_t size = std::min(one * count, sent.bytes.size() - sent.at);
  if (size > 0) std::memcpy(data, sent.bytes.data() + sent.at, size);
  sent.at += size;
  return size;
}

// Back to the begin, where a connection was lost that had been kept open.
int rewind(void* from, curl_off_t offset, int origin) {
  auto& sent = *static_cast<Sent*>(from);
  if (origin != SEEK_SET || offset < 0 || static_cast<std::uint64_t>(offset) > sent.bytes.size())
    return CURL_SEEKFUNC_FAIL;
  sent.at = static_cast<std::size_t>(offset);
  return CURL_SEEKFUNC_OK;
}

// A text of libcurl's. It may quote a URL with user and password: that of the proxy, from the environment.
std::string withoutCredentials(std::string text) {
  const std::size_t end = text.rfind('@');
  if (end == std::string::npos) return text;
  std::size_t begin = std::min(text.find_first_of("'\""), end);
  begin = begin < end ? begin + 1 : text.find_last_of(' ', end) + 1;
  if (const std::size_t scheme = text.find("://", begin); scheme < end) begin = scheme + 3;
  return text.erase(begin, end + 1 - begin);
}

bool startCurl() {
  static const bool started = curl_global_init(CURL_GLOBAL_DEFAULT) == CURLE_OK;
  return started;
}

template <auto kFree>
struct Freed {
  void operator()(auto* handle) const { kFree(handle); }
};
using Easy = std::unique_ptr<CURL, Freed<curl_easy_cleanup>>;
using Multi = std::unique_ptr<CURLM, Freed<curl_multi_cleanup>>;
using Headers = std::unique_ptr<curl_slist, Freed<curl_slist_free_all>>;
using Url = std::unique_ptr<CURLU, Freed<curl_url_cleanup>>;

// A part of a URL, or "".
std::string partOf(CURLU* url, CURLUPart part) {
  char* text = nullptr;
  if (curl_url_get(url, part, &text, 0) != CURLUE_OK) return {};
  std::string copy(text);
  curl_free(text);
  return copy;
}

// The URL as messages may show it, or "".
std::string withoutUser(const std::string& url) {
  const Url parsed(curl_url());
  if (!parsed || curl_url_set(parsed.get(), CURLUPART_URL, url.c_str(), 0) != CURLUE_OK) return {};
  curl_url_set(parsed.get(), CURLUPART_USER, nullptr, 0);
  curl_url_set(parsed.get(), CURLUPART_PASSWORD, nullptr, 0);
  return partOf(parsed.get(), CURLUPART_URL);
}

class HttpStore : public Store {
 public:
  HttpStore(std::string url, std::string shown, std::function<bool()> cancelled)
      : url_(std::move(url)), shown_(std::move(shown)), cancelled_(std::move(cancelled)), multi_(curl_multi_init()) {}

  Result<std::optional<Bytes>> get(const EntryName& name, std::uint64_t maxBytes) override {
    Received received;
    received.isWanted = true;
    received.maxBytes = maxBytes;
    const Result<long> answer = run(name, received, nullptr);
    if (!answer) return answer.error();
    if (*answer == kNotFound || *answer == kGone) return std::optional<Bytes>();
    if (*answer != kFound) return Error{ErrorCode::io, "GET: " + describeAnswer(name, *answer)};
    return std::optional(std::move(received.bytes));
  }

  Status put(const EntryName& name, std::span<const std::byte> bytes) override {
    Received ignored;
    Sent sent{bytes};
    const Result<long> answer = run(name, ignored, &sent);
    if (!answer) return answer.error();
    if (*answer >= kMadeFirst && *answer <= kMadeLast) return done();
    return Error{ErrorCode::io, "PUT of " + std::to_string(bytes.size()) + " bytes: " + describeAnswer(name, *answer)};
  }

  Status hold(std::uint64_t) override { return done(); }  // the server's own to do
  std::string name() const override { return shown_; }

 private:
  // An answer that helps nobody, and what to do.
  std::string describeAnswer(const EntryName& name, long status) const {
    const std::string answers = "the server answers " + std::to_string(status);
    if (status == kFull) return answers + ": it is full";
    if (status == kTooLarge) return answers + ": it does not take so much at once (nginx: client_max_body_size)";
    if (status == kUnauthorized)
      return answers + (url_ == shown_ ? ": it asks for a user and a password; the URL of the store may have them, "
                                         "http://USER:PASSWORD@SERVER/FOLDER"
                                       : ": it does not take the user and the password of the store's URL");
    if (status == kProxyUnauthorized)
      return answers + ": the proxy asks for a user and a password; its URL may have them (http_proxy, https_proxy)";
    char* target = nullptr;
    curl_easy_getinfo(easy_.get(), CURLINFO_REDIRECT_URL, &target);
    if (target == nullptr) return answers;
    std::string there = withoutUser(target);
    if (const std::string entry = pathOf(name); there.ends_with(entry)) there.resize(there.size() - entry.size());
    constexpr std::size_t kMaxShown = 200;
    return answers + ": redirects are not followed; the store's own URL expected" +
           (there.empty() ? "" : ", it leads to " + there.substr(0, kMaxShown));
  }

  // Of an entry, behind the URL.
  static std::string pathOf(const EntryName& name) {
    const std::string entry = toString(name);
    return folderOf(entry) + "/" + entry;
  }

  // The status of the server's answer. io: there is none.
  Result<long> run(const EntryName& name, Received& received, Sent* sent) {
    if (!easy_) easy_.reset(curl_easy_init());
    if (!easy_ || !multi_) return Error{ErrorCode::io, "libcurl cannot be started"};
    CURL* const easy = received.easy = easy_.get();
    curl_easy_reset(easy);  // connections stay
    const std::string url = url_ + pathOf(name);
    char reason[CURL_ERROR_SIZE] = "";
    // Neither compression of the server's nor a 100-continue to wait for.
    const Headers headers(curl_slist_append(nullptr, "Expect:"));
    curl_easy_setopt(easy, CURLOPT_URL, url.c_str());
    curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(easy, CURLOPT_ERRORBUFFER, reason);
    curl_easy_setopt(easy, CURLOPT_HTTPHEADER, headers.get());
    curl_easy_setopt(easy, CURLOPT_USERAGENT, "relume");
    curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT_MS, kConnectMs);
    curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, kSlowBytes);
    curl_easy_setopt(easy, CURLOPT_LOW_SPEED_TIME, kSlowSeconds);
    curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, receive);
    curl_easy_setopt(easy, CURLOPT_WRITEDATA, &received);
    if (sent != nullptr) {
      curl_easy_setopt(easy, CURLOPT_UPLOAD, 1L);
      curl_easy_setopt(easy, CURLOPT_READFUNCTION, send);
      curl_easy_setopt(easy, CURLOPT_READDATA, sent);
      curl_easy_setopt(easy, CURLOPT_SEEKFUNCTION, rewind);
      curl_easy_setopt(easy, CURLOPT_SEEKDATA, sent);
      curl_easy_setopt(easy, CURLOPT_INFILESIZE_LARGE, static_cast<curl_off_t>(sent->bytes.size()));
    }

    const CURLcode result = perform(easy, received);
    if (result == CURLE_ABORTED_BY_CALLBACK) return cancelledError();
    if (!received.sound) return received.sound.error();
    if (result != CURLE_OK)
      return Error{ErrorCode::io, withoutCredentials(*reason != 0 ? reason : curl_easy_strerror(result))};
    long status = 0;
    curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &status);
    return status;
  }

  // As curl_easy_perform(), but it stops when the bake is cancelled, or has waited long enough.
  CURLcode perform(CURL* easy, const Received& received) {
    CURLcode result = CURLE_ABORTED_BY_CALLBACK;
    curl_multi_add_handle(multi_.get(), easy);
    for (int running = 1; running > 0;) {
      if (cancelled_ && cancelled_()) break;
      if (goesOn_ && !goesOn_(received.bytes.size())) {
        result = CURLE_OPERATION_TIMEDOUT;
        break;
      }
      if (curl_multi_perform(multi_.get(), &running) != CURLM_OK) break;
      if (running > 0) curl_multi_poll(multi_.get(), nullptr, 0, kPollMs, nullptr);
    }
    int left = 0;
    while (const CURLMsg* message = curl_multi_info_read(multi_.get(), &left)) {
      if (message->msg == CURLMSG_DONE) result = message->data.result;
    }
    curl_multi_remove_handle(multi_.get(), easy);
    return result;
  }

  std::string url_, shown_;
  std::function<bool()> cancelled_;
  Multi multi_;
  Easy easy_;
};

}  // namespace

Result<std::unique_ptr<Store>> openHttpStore(const std::string& url, std::function<bool()> cancelled) {
  if (!startCurl()) return Error{ErrorCode::io, "libcurl cannot be started"};
  const Url parsed(curl_url());
  const auto refused = [&](const std::string& why) {
    return Error{ErrorCode::usage, "the URL of a store: expected http:// or https://, a server and a folder, " + why};
  };
  if (url.compare(url.find(':') + 1, 2, "//") != 0) return refused("found one without //");
  if (!parsed || curl_url_set(parsed.get(), CURLUPART_URL, url.c_str(), 0) != CURLUE_OK)
    return refused("found one that cannot be read");
  const std::string scheme = partOf(parsed.get(), CURLUPART_SCHEME);
  if (scheme != "http" && scheme != "https") return refused("found \"" + scheme + "://\"");
  if (!partOf(parsed.get(), CURLUPART_QUERY).empty() || !partOf(parsed.get(), CURLUPART_FRAGMENT).empty())
    return refused("found one with ? or #");
  std::string path = partOf(parsed.get(), CURLUPART_PATH);
  if (!path.ends_with('/')) path += '/';
  curl_url_set(parsed.get(), CURLUPART_PATH, path.c_str(), 0);
  std::string whole = partOf(parsed.get(), CURLUPART_URL), shown = withoutUser(whole);
  return std::unique_ptr<Store>(std::make_unique<HttpStore>(std::move(whole), std::move(shown), std::move(cancelled)));
}

}  // namespace relume
