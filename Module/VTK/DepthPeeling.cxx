// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "DepthPeeling.h"

#include "GLObjects.h"
#include "GLStateGuard.h"
#include "ShaderLibrary.h"
#include "vtkDualDepthPeelingPass.h"
#include "vtkInformation.h"
#include "vtkInformationObjectBaseVectorKey.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkOpenGLShaderCache.h"
#include "vtkOpenGLState.h"
#include "vtkShaderProgram.h"
#include "vtkTextureUnitManager.h"
#include "vtkVolume.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace teravox
{

namespace
{

struct Texts
{
  std::string Vertex;
  std::string Fragment;
};

Result<Texts> TextsOf(vtkDualDepthPeelingPass* pass, vtkAbstractMapper* mapper, vtkVolume* volume)
{
  Result<std::string> vertex = AssembleShader("FullScreen.vert", {});
  Result<std::string> fragment = AssembleShader("Peel.frag", {});
  if (!vertex || !fragment)
  {
    return !vertex ? vertex.GetStatus() : fragment.GetStatus();
  }
  Texts texts{ vertex.Value(), fragment.Value() };
  std::string geometry;
  pass->PreReplaceShaderValues(texts.Vertex, geometry, texts.Fragment, mapper, volume);
  // What the pass writes is used once more before it is written.
  const std::string targets = "gl_FragData";
  for (std::size_t at = texts.Fragment.find(targets); at != std::string::npos;
       at = texts.Fragment.find(targets, at))
  {
    texts.Fragment.replace(at, targets.size(), "g_data");
  }
  return texts;
}

// A texture unit that VTK doesn't use meanwhile.
class Unit
{
public:
  explicit Unit(vtkTextureUnitManager* manager)
    : Manager(manager)
    , Number(manager->Allocate())
  {
  }
  Unit(const Unit&) = delete;
  Unit& operator=(const Unit&) = delete;
  Unit(Unit&&) = delete;
  Unit& operator=(Unit&&) = delete;
  ~Unit()
  {
    if (this->Number >= 0)
    {
      this->Bind(0);
      this->Manager->Free(this->Number);
    }
  }
  bool IsThere() const { return this->Number >= 0; }
  int Get() const { return this->Number; }
  void Bind(GLuint texture) const
  {
    glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + this->Number));
    glBindTexture(GL_TEXTURE_2D, texture);
  }

private:
  vtkTextureUnitManager* Manager;
  int Number;
};

// Runs Peel.frag over the frame buffer that is bound for drawing, in the state that is set.
// `colors`: of the stretches, 0: there are none; nothing: the stretches are kept.
Status Run(const Texts& texts, const FrameRequest& request, vtkDualDepthPeelingPass* pass,
  vtkAbstractMapper* mapper, vtkVolume* volume, vtkOpenGLRenderWindow* window,
  const std::optional<std::array<GLuint, 2>>& colors)
{
  const Unit first(window->GetState()->GetTextureUnitManager());
  const Unit second(window->GetState()->GetTextureUnitManager());
  vtkShaderProgram* program =
    window->GetShaderCache()->ReadyShaderProgram(texts.Vertex.c_str(), texts.Fragment.c_str(), "");
  if (program == nullptr || !first.IsThere() || !second.IsThere())
  {
    return Status(StatusCode::Unsupported,
      "Depth peeling of this version of VTK can't be followed: its shader doesn't compile, or no "
      "texture unit is left.");
  }
  const std::array<GLuint, 2> given = colors.value_or(std::array<GLuint, 2>{ 0, 0 });
  first.Bind(given[0]);
  second.Bind(given[1]);
  const std::array<float, 2> inverse{ 1.0f / static_cast<float>(request.Camera.Width),
    1.0f / static_cast<float>(request.Camera.Height) };
  const std::array<int, 2> has{ given[0] != 0 ? 1 : 0, given[1] != 0 ? 1 : 0 };
  const std::array<float, 2> range{ request.Final.Scale, request.Final.Bias };
  program->SetUniform2f("in_inverseWindowSize", inverse.data());
  program->SetUniformi("u_give", colors ? 1 : 0);
  program->SetUniform2i("u_has", has.data());
  program->SetUniform2f("u_window", range.data());
  program->SetUniformi("u_first", first.Get());
  program->SetUniformi("u_second", second.Get());
  pass->SetShaderParameters(program, mapper, volume);
  const GLVertexArray vertices = GLVertexArray::Make();
  glBindVertexArray(vertices.Id());
  glViewport(0, 0, request.Camera.Width, request.Camera.Height);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  window->GetShaderCache()->ReleaseCurrentShader();
  return {};
}

using Stretches = std::array<std::shared_ptr<RayDepths>, 2>;

// The stretches of each pixel's ray; without those that no pixel has.
Result<Stretches> Ask(const Texts& texts, GLuint texture, const FrameRequest& request,
  vtkDualDepthPeelingPass* pass, vtkAbstractMapper* mapper, vtkVolume* volume,
  vtkOpenGLRenderWindow* window)
{
  const GLStateGuard guard;
  const GLFramebuffer target = GLFramebuffer::Make();
  glBindFramebuffer(GL_FRAMEBUFFER, target.Id());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
  const std::array<GLenum, 3> targets{ GL_NONE, GL_NONE, GL_COLOR_ATTACHMENT0 };
  glDrawBuffers(3, targets.data());
  const std::array<float, 4> none{ 1, 0, 1, 0 };
  glClearBufferfv(GL_COLOR, 2, none.data());
  if (Status status = Run(texts, request, pass, mapper, volume, window, std::nullopt); !status)
  {
    return status;
  }
  std::vector<std::array<float, 4>> texels(static_cast<std::size_t>(request.Camera.Width) *
    static_cast<std::size_t>(request.Camera.Height));
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  glReadPixels(0, 0, request.Camera.Width, request.Camera.Height, GL_RGBA, GL_FLOAT, texels.data());
  Stretches stretches;
  for (std::size_t s = 0; s < 2; ++s)
  {
    const auto isAny = [s](const std::array<float, 4>& t) { return t[2 * s] < t[2 * s + 1]; };
    if (std::none_of(texels.begin(), texels.end(), isAny))
    {
      continue;
    }
    stretches[s] = std::make_shared<RayDepths>();
    for (const std::array<float, 4>& t : texels)
    {
      const bool is = isAny(t);
      stretches[s]->Begin.push_back(is ? t[2 * s] : 1);
      stretches[s]->End.push_back(is ? t[2 * s + 1] : 0);
    }
    // Where there is no ray, its end says so, too.
    const auto isNear = [&](const std::array<float, 4>& t) { return !isAny(t) || !(t[2 * s] > 0); };
    if (std::all_of(texels.begin(), texels.end(), isNear))
    {
      stretches[s]->Begin.clear();
    }
  }
  return stretches;
}

// Blends colours over what the pass's targets hold.
Status Give(const Texts& texts, const std::array<GLuint, 2>& colors, const FrameRequest& request,
  vtkDualDepthPeelingPass* pass, vtkAbstractMapper* mapper, vtkVolume* volume,
  vtkOpenGLRenderWindow* window)
{
  GLint equation = GL_FUNC_ADD;
  glGetIntegerv(GL_BLEND_EQUATION_RGB, &equation);
  Status status;
  {
    const GLStateGuard guard;
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, request.Framebuffer);
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    status = Run(texts, request, pass, mapper, volume, window, colors);
  }
  glBlendEquation(static_cast<GLenum>(equation));
  return status;
}

// Where the rays of a frame end: behind the stretches known so far, and these. In front of opaque
// geometry, the last of them come with the first peel.
std::shared_ptr<const RayDepths> WholeOf(
  const std::shared_ptr<const RayDepths>& known, const Stretches& stretches, std::size_t pixels)
{
  auto whole = known ? std::make_shared<RayDepths>(*known) : std::make_shared<RayDepths>();
  whole->End.resize(pixels, 0);
  for (const auto& stretch : stretches)
  {
    for (std::size_t i = 0; stretch && i < pixels; ++i)
    {
      whole->End[i] = std::max(whole->End[i], stretch->End[i]);
    }
  }
  return known && known->End == whole->End ? known : whole;
}

} // namespace

vtkDualDepthPeelingPass* DepthPeeling::PassOf(vtkProp* prop)
{
  vtkInformation* info = prop->GetPropertyKeys();
  vtkInformationObjectBaseVectorKey* key = vtkOpenGLRenderPass::RenderPasses();
  if (info == nullptr || !info->Has(key))
  {
    return nullptr;
  }
  for (int i = 0; i < key->Length(info); ++i)
  {
    if (auto* pass = vtkDualDepthPeelingPass::SafeDownCast(key->Get(info, i)))
    {
      return pass;
    }
  }
  return nullptr;
}

Status DepthPeeling::Draw(const StretchPainter& painter, FrameRequest& request,
  vtkDualDepthPeelingPass* pass, vtkAbstractMapper* mapper, vtkVolume* volume,
  vtkOpenGLRenderWindow* window)
{
  Result<Texts> texts = TextsOf(pass, mapper, volume);
  if (!texts)
  {
    return texts.GetStatus();
  }
  // With peels behind it, it goes on with a front; what is left over in the end has one stretch.
  const auto says = [&texts](const char* text)
  { return texts.Value().Fragment.find(text) != std::string::npos; };
  this->First = !says("lastFrontColorTex") && !says("depthRangeTex");

  FrameRequest stretch = request;
  stretch.Show = false;
  stretch.IsStretch = true;
  stretch.ErrorEstimate = false;
  stretch.ShowFrames = false;
  stretch.HitOpacity = std::nullopt;
  Result<GLuint> texture = painter.Prepare(stretch);
  if (!texture)
  {
    return texture.GetStatus();
  }
  Result<Stretches> asked =
    Ask(texts.Value(), texture.Value(), request, pass, mapper, volume, window);
  if (!asked)
  {
    return asked.GetStatus();
  }
  if (this->First)
  {
    this->Begun = false;
    this->Whole = nullptr;
  }
  request.Depths = WholeOf(this->Whole, asked.Value(),
    static_cast<std::size_t>(request.Camera.Width) *
      static_cast<std::size_t>(request.Camera.Height));
  const bool isKnown = this->Whole == request.Depths;
  this->Whole = request.Depths;
  if (request.HitOpacity)
  {
    // Pictures for RenderToImage() are of whole rays, and aren't shown.
    return isKnown ? Status() : painter.Render(request);
  }
  std::array<GLuint, 2> colors{ 0, 0 };
  for (std::size_t s = 0; s < 2; ++s)
  {
    if (!asked.Value()[s])
    {
      continue;
    }
    stretch.Depths = asked.Value()[s];
    stretch.Continues = std::exchange(this->Begun, true);
    if (Status status = painter.Render(stretch); !status)
    {
      return status;
    }
    colors[s] = painter.Colors(s == 0 && asked.Value()[1] != nullptr);
  }
  return colors[0] != 0 || colors[1] != 0
    ? Give(texts.Value(), colors, request, pass, mapper, volume, window)
    : Status();
}

} // namespace teravox
