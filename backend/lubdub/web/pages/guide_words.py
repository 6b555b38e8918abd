"""What each scanning app is, how a scan is made and exported with it, and what goes wrong. Seen by people: gettext."""

from __future__ import annotations

from dataclasses import dataclass

from lubdub.web.pages.questions import Gettext

APPS = ("scaniverse", "scanner3d", "polycam", "kiri", "record3d", "file", "none")


@dataclass(frozen=True)
class AppCard:
    """name: in addresses; title and note: as the choice is worded; picture: a drawing's name."""

    name: str
    title: str
    note: str
    picture: str


@dataclass(frozen=True)
class AppWords:
    """steps: in order; care: what goes wrong with this app; scale: what to do about a size it does not know."""

    name: str
    title: str
    lead: str
    steps: tuple[str, ...]
    care: tuple[str, ...] = ()
    scale: str = ""


def app_cards(_: Gettext) -> list[AppCard]:
    """The choices: apps by name, then a file, then nothing at all."""
    return [
        AppCard("scaniverse", "Scaniverse", _("iPhone, iPad or Android. Free. A good first choice."), "app"),
        AppCard("scanner3d", "3d Scanner App", _("iPhone or iPad. Mostly free. A good choice for a chest."), "app"),
        AppCard("polycam", "Polycam", _("iPhone, iPad or Android. Choose the free GLTF file."), "app"),
        AppCard("kiri", "KIRI Engine", _("iPhone or Android. It works from photos and cannot know sizes."), "app"),
        AppCard("record3d", "Record3D", _("iPhone or iPad. It records videos with depth. Export costs money."), "app"),
        AppCard("file", _("A file I already have"), _("From another app, a scanner or a clinic."), "file"),
        AppCard("none", _("I have no such phone or app"), _("See who can help."), "help"),
    ]


def words_of_app(name: str, _: Gettext) -> AppWords:
    """The page of one choice. name: one of APPS."""
    makers = {
        "scaniverse": _scaniverse,
        "scanner3d": _scanner3d,
        "polycam": _polycam,
        "kiri": _kiri,
        "record3d": _record3d,
        "file": _file,
        "none": _none,
    }
    return makers[name](_)


def _scaniverse(_: Gettext) -> AppWords:
    return AppWords(
        "scaniverse",
        _("Scan with Scaniverse"),
        _("Have a quick read before you start. You can come back to this page."),
        (
            _("Open Scaniverse and start a new scan."),
            _("When it asks, choose Mesh. Do not choose Splat."),
            _("Scan the chest as shown on the next page, then stop and wait until the model is ready."),
            _("Tap Share, then Export model, then GLB or OBJ."),
            _("Save the file on your phone. You will send it to us here."),
        ),
        (_("A splat looks pretty but has no skin to measure on. If you made one, please scan again with Mesh."),),
        _("On a phone without a depth sensor the size may be a little off. We will ask you whether it is right."),
    )


def _scanner3d(_: Gettext) -> AppWords:
    return AppWords(
        "scanner3d",
        _("Scan with 3d Scanner App"),
        _("Have a quick read before you start. You can come back to this page."),
        (
            _("Open 3d Scanner App and choose the LiDAR mode. Use the camera on the back of the phone."),
            _("Scan the chest as shown on the next page, then stop and let the app finish the model with colour."),
            _("Tap Share, then GLB. OBJ and STL are fine too."),
            _("Save the file on your phone. You will send it to us here."),
        ),
        (
            _("Do not use the selfie camera. It can swap left and right."),
            _("The mode that uses photos does not know the size. Choose LiDAR."),
        ),
    )


def _polycam(_: Gettext) -> AppWords:
    return AppWords(
        "polycam",
        _("Scan with Polycam"),
        _("Have a quick read before you start. You can come back to this page."),
        (
            _("Open Polycam and choose LiDAR, if your phone has it."),
            _("Scan the chest as shown on the next page, then stop and let the app process it."),
            _("Tap Export, then GLTF. It is free, and saves a file that ends in .glb."),
            _("Save the file on your phone. You will send it to us here."),
        ),
        (_("You do not need to pay. The other kinds of files cost money and are no better for us."),),
        _("Polycam’s photo mode does not know the true size. Use LiDAR, or wear the printed stickers below."),
    )


def _kiri(_: Gettext) -> AppWords:
    return AppWords(
        "kiri",
        _("Scan with KIRI Engine"),
        _("This app guesses the shape from photos. It can work, but another app is safer."),
        (
            _("If your phone has LiDAR, choose the LiDAR scan. If not, choose the photo scan."),
            _("Go slowly around the chest as shown on the next page."),
            _("Send the photos, and wait until the model is ready."),
            _("Tap Export, then GLB or OBJ. If it comes as a zip file, leave it as it is."),
            _("Save the file on your phone. You will send it to us here."),
        ),
        (_("Do not choose the 3DGS mode. It makes a splat, and a splat has no skin to measure on."),),
        _(
            "Photos do not know the true size: the chest may come out as small as an apple. Wear the printed "
            "stickers below, so that we can check the size, or use Scaniverse or 3d Scanner App instead."
        ),
    )


def _record3d(_: Gettext) -> AppWords:
    return AppWords(
        "record3d",
        _("Scan with Record3D"),
        _("This app records a video with depth. We need one picture out of it, as a 3D model."),
        (
            _("Open Record3D and choose the LiDAR camera on the back."),
            _("Hold the phone about 60 cm above the chest, so that neck and belly button are both in the picture."),
            _("Record two or three seconds while the chest is quiet, just after breathing out."),
            _("Open the recording, go to one sharp picture, and choose Export, then GLB or PLY."),
            _("Save the file on your phone. You will send it to us here."),
        ),
        (
            _("A file that ends in .r3d is the video itself. We cannot read it. Export one picture instead."),
            _("Do not use the selfie camera. It can swap left and right."),
        ),
    )


def _file(_: Gettext) -> AppWords:
    return AppWords(
        "file",
        _("A file you already have"),
        _("We can read most 3D files. You do not have to know which one it is: we will tell you if it does not work."),
        (
            _("Best is a file that ends in .glb, .ply, .obj or .stl. A zip of it is fine."),
            _("The skin must be bare from neck to belly button, and the person must lie or sit as you said before."),
            _("The scan should be new. Children grow fast."),
        ),
        (
            _("A photo or a video is not a 3D scan. We cannot measure on it."),
            _("A file that ends in .usdz, .r3d, .las or .splat: please export it again as GLB, OBJ or PLY."),
            _("It must not be mirrored: left has to be left."),
        ),
    )


def _none(_: Gettext) -> AppWords:
    return AppWords(
        "none",
        _("No such phone? Here is who can help"),
        _("You do not have to buy anything. Nothing is lost: what you told us stays here."),
        (
            _("Ask family or friends. iPhones and iPads with “Pro” in the name have a depth sensor called LiDAR."),
            _("Many Android phones can scan with the free app Scaniverse."),
            _("Ask the clinic that sent you here. They may have a scanner, or show you the places by video."),
            _("No scan at all? Your clinician can tell you where to listen. That is just as good."),
        ),
    )
