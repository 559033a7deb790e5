#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/view_based/view_library.h"
#include "viewer/window/commands.h"
#include "viewer/window/outline_marks.h"
#include "viewer/window/overlay.h"
#include "viewer/window/picture_sheet.h"
#include "viewer/window/registration_marks.h"

namespace scanview {

/// One view's picture laid flat, and the points and outlines that a person draws over it. Pixels without a depth are
/// dark. Every change is written at once to FOLDER/marks.json (points) or FOLDER/mesh_marks.json (outlines); what is
/// there is read first and kept.
class MarkingDesk {
 public:
  /// `folder` is the set's; empty for a set in memory, whose marks are not kept.
  MarkingDesk(std::shared_ptr<ViewLibrary> library, std::filesystem::path folder);
  /// After a reload. The view stays where it still exists.
  void use(std::shared_ptr<ViewLibrary> library);

  /// Begins a mode. Throws Error{bad_input} where the mode's file is there and is not one of its kind: writing would
  /// destroy it. Nothing has changed then.
  void enter(WindowMode mode);
  WindowMode mode() const { return mode_; }

  std::size_t view() const { return view_; }
  /// Reads its picture. False where there is no such view.
  bool show(std::size_t view);
  void step(int views);  ///< to the next or previous, around

  /// What a click in the viewport does; a message for the person, "" where all went well. Points need a pixel of the
  /// picture that has a depth; a corner beside the picture goes to its border.
  std::string click(double x, double y);
  /// A command of the mode (remove_last, close_outline, previous_view, ...); likewise.
  std::string obey(Command command);
  OutlineKind kind = OutlineKind::remove;  ///< of the next outline that is closed

  PictureSheet& sheet() { return sheet_; }
  /// The window's content. The first call after show() fits the picture in.
  cv::Mat4b draw(int width, int height);
  Overlay overlay() const;
  /// What to do, what is there, and the command that reads the file.
  std::vector<std::string> text() const;

 private:
  std::string const& name() const { return library_->set().views[view_].name; }
  std::filesystem::path file() const;
  std::string save() const;

  std::shared_ptr<ViewLibrary> library_;
  std::filesystem::path folder_;
  WindowMode mode_ = WindowMode::mark;
  std::size_t view_ = 0;
  std::string unreadable_;  ///< why there is no picture of the view
  cv::Mat3b picture_;       ///< dark where there is no depth
  cv::Mat1b classes_;
  bool fitted_ = false;
  PictureSheet sheet_;
  RegistrationMarks marks_;
  OutlineMarks outlines_;
  int number_ = 1;  ///< of the next point
};

}  // namespace scanview
