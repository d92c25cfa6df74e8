// SPDX-License-Identifier: MIT
// See drop_file.h. The source owns the selection XdndSelection, says to the target what it has and where the mouse is,
// and hands the list of files over when the target asks for it.
#include "tests/view/drop_file.h"

#include <X11/Xatom.h>
#include <X11/Xlib.h>

#include <chrono>
#include <thread>

namespace relume {
namespace {

class Source {
 public:
  explicit Source(const std::string& name) : display_(XOpenDisplay(name.c_str())) {
    if (!display_) return;
    root_ = DefaultRootWindow(display_);
    window_ = XCreateSimpleWindow(display_, root_, 0, 0, 1, 1, 0, 0, 0);
    XSetSelectionOwner(display_, atom("XdndSelection"), window_, CurrentTime);
  }
  ~Source() {
    if (display_) XCloseDisplay(display_);
  }
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  std::string drop(const std::filesystem::path& file) {
    if (!display_) return "no display";
    const Window target = findTarget();
    if (target == None) return "no window takes drops";
    list_ = "file://" + file.string() + "\r\n";
    const int screen = DefaultScreen(display_);
    const long middle = (DisplayWidth(display_, screen) / 2L) << 16 | DisplayHeight(display_, screen) / 2L;
    send(target, "XdndEnter", 5L << 24, static_cast<long>(atom("text/uri-list")), 0, 0);
    send(target, "XdndPosition", 0, middle, CurrentTime, static_cast<long>(atom("XdndActionCopy")));
    if (!await("XdndStatus")) return "the window does not answer";
    send(target, "XdndDrop", 0, CurrentTime, 0, 0);
    return await("XdndFinished") ? "" : "the window does not finish the drop";
  }

 private:
  Atom atom(const char* name) const { return XInternAtom(display_, name, False); }

  // The child of the root that says it takes drops.
  Window findTarget() const {
    Window root = None, parent = None, found = None, *children = nullptr;
    unsigned count = 0;
    if (!XQueryTree(display_, root_, &root, &parent, &children, &count)) return None;
    for (unsigned i = 0; i < count; ++i) {
      Atom type = None;
      int format = 0;
      unsigned long items = 0, left = 0;
      unsigned char* data = nullptr;
      XGetWindowProperty(display_, children[i], atom("XdndAware"), 0, 1, False, AnyPropertyType, &type, &format, &items,
                         &left, &data);
      if (data) XFree(data);
      if (items > 0) found = children[i];
    }
    if (children) XFree(children);
    return found;
  }

  void send(Window target, const char* message, long b, long c, long d, long e) {
    XEvent event{};
    event.xclient.type = ClientMessage;
    event.xclient.window = target;
    event.xclient.message_type = atom(message);
    event.xclient.format = 32;
    const long data[] = {static_cast<long>(window_), b, c, d, e};
    for (int i = 0; i < 5; ++i) event.xclient.data.l[i] = data[i];
    XSendEvent(display_, target, False, NoEventMask, &event);
    XFlush(display_);
  }

  // Whether that message comes within ten minutes; the list of files is handed over meanwhile.
  bool await(const char* message) {
    for (int i = 0; i < 60000; ++i) {
      while (XPending(display_) > 0) {
        XEvent event;
        XNextEvent(display_, &event);
        if (event.type == SelectionRequest) answer(event.xselectionrequest);
        if (event.type == ClientMessage && event.xclient.message_type == atom(message)) return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  void answer(const XSelectionRequestEvent& request) {
    XChangeProperty(display_, request.requestor, request.property, request.target, 8, PropModeReplace,
                    reinterpret_cast<const unsigned char*>(list_.data()), static_cast<int>(list_.size()));
    XEvent event{};
    event.xselection.type = SelectionNotify;
    event.xselection.requestor = request.requestor;
    event.xselection.selection = request.selection;
    event.xselection.target = request.target;
    event.xselection.property = request.property;
    event.xselection.time = request.time;
    XSendEvent(display_, request.requestor, False, NoEventMask, &event);
    XFlush(display_);
  }

  Display* display_;
  Window root_ = None, window_ = None;
  std::string list_;
};

}  // namespace

std::string dropFile(const std::string& display, const std::filesystem::path& file) {
  return Source(display).drop(file);
}

}  // namespace relume
