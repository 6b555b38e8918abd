"""Every sentence this room says to a person: why a file cannot be read, and why a scan is refused or doubted."""

from __future__ import annotations

from collections.abc import Mapping

from lubdub.results import UNREADABLE_FILE, Reason, ScanUnreadable


def _other(message: str, advice: str) -> Reason:
    return Reason(UNREADABLE_FILE, message, advice)


def _foreign(message: str) -> Reason:
    return _other(message, "Please open it in your scanning app and export the scan as a PLY, OBJ, GLB or STL file.")


def _damaged(message: str) -> Reason:
    return _other(message, "Please export the scan again and upload the new file.")


UNREADABLE: Mapping[str, Reason] = {
    "empty": _damaged("This file is empty."),
    "too_large": _other(
        "This file is larger than 300 MB.", "Please export it with less detail, or cut it down to the chest."
    ),
    "unknown": _foreign("We do not know this kind of file."),
    "picture": _foreign("This file is a picture, not a 3D scan."),
    "video": _foreign("This file is a video, not a 3D scan."),
    "pdf": _foreign("This file is a PDF document, not a 3D scan."),
    "page": _foreign("This file is a web page, not a 3D scan. Perhaps the download did not work."),
    "usdz": _foreign("This is a USDZ file, which we cannot read."),
    "gltf_text": _foreign("This is a glTF text file that needs other files beside it."),
    "fbx": _foreign("This is an FBX file, which we cannot read."),
    "las": _foreign("This is a LAS or LAZ file from surveying, which we cannot read."),
    "e57": _foreign("This is an E57 file from surveying, which we cannot read."),
    "dae": _foreign("This is a DAE (Collada) file, which we cannot read."),
    "3mf": _foreign("This is a 3MF file for printing, which we cannot read."),
    "off": _foreign("This is an OFF file, which we cannot read."),
    "dicom": _foreign("This is a DICOM medical image, not a scan of the skin."),
    "record3d": _foreign("This is a Record3D recording, which we cannot read."),
    "packed": _other("This is a packed file that we cannot open.", "Please unpack it and upload the scan inside it."),
    "splat": _other(
        "This is a Gaussian splat, a kind of picture with no skin surface in it.",
        "Please scan again in mesh mode and export a PLY, OBJ, GLB or STL file.",
    ),
    "draco": _other(
        "This GLB file is compressed in a way we cannot read.",
        "Please export it without compression, or as a PLY, OBJ or STL file.",
    ),
    "zip_none": _foreign("There is no scan in this ZIP file."),
    "zip_many": _other("There is more than one scan in this ZIP file.", "Please upload one scan at a time."),
    "zip_unsafe": _other(
        "This ZIP file is not safe to unpack.", "Please unpack it yourself and upload the scan inside it."
    ),
    "other_files": _foreign("This file needs other files that were not uploaded."),
    "cut_short": _damaged("This file is cut short: it says it holds more than it does."),
    "too_long": _damaged("This file holds more than it says, so it is damaged."),
    "too_many_points": _other("This scan has more than 5 million points.", "Please export it with less detail."),
    "too_many_faces": _other("This scan has more than 10 million faces.", "Please export it with less detail."),
    "no_points": _damaged("There are no points in this file."),
    "bad_number": _damaged("This file has broken numbers in it."),
    "bad_face": _damaged("This file holds faces that do not fit its points, so it is damaged."),
    "bad_line": _damaged("There are lines in this file that do not belong there, so it is damaged."),
    "bad_header": _damaged("The beginning of this file is damaged, so we cannot tell what is in it."),
    "bad_unit": _other(
        "The unit must be m, cm or mm.", "Please choose one of these, or leave it out and let us find it."
    ),
}


def unreadable(what: str) -> ScanUnreadable:
    """The error for one key of UNREADABLE."""
    return ScanUnreadable(UNREADABLE[what])


UNIT_IMPLAUSIBLE = Reason(
    "unit_implausible",
    "We cannot tell how large this body is.",
    "Please say if the file is in m, cm or mm. Or scan again with an app that measures.",
)

UNIT_WRONG = Reason(
    "unit_implausible",
    "In this unit the body would be far too large or too small for a person.",
    "Please check if the file is in m, cm or mm. Or scan again with an app that measures.",
)

MARKS_IMPLAUSIBLE = Reason(
    "landmarks_fit_nobody",
    "The marked points lie much too far apart, or much too close together, for a person.",
    "Please check that each point is on the right place of this very scan. If they are, check if the file is in m, "
    "cm or mm.",
)

TOO_FEW_POINTS = Reason(
    "too_few_points",
    "There is too little of a body in this scan to see its shape.",
    "Please scan again, slowly, from about an arm's length away.",
)

NO_BODY_FOUND = Reason(
    "no_body_found",
    "We could not find a body in this scan.",
    "Please scan the bare chest from neck to belly button and keep other things out of the picture.",
)

LANDMARKS_OFF_SCAN = Reason(
    "landmarks_off_scan",
    "The marked points do not lie on this scan.",
    "Please check that the points were marked on this very scan and in its own unit, or mark them again.",
)

SPARSE_SCAN = Reason(
    "sparse_scan",
    "The points of this scan are far apart, so small shapes are missing.",
    "If you can, scan again more slowly and a little closer.",
)

NOISY_SCAN = Reason(
    "noisy_scan",
    "The skin in this scan is very rough. The person or the phone may have moved.",
    "If you can, scan again in even light while the person lies still and breathes calmly.",
)

MIRRORED_FILE = Reason(
    "mirrored_file",
    "This file says that the body in it is mirrored, so left and right may be exchanged.",
    "Check on the person that place 4 lies on the side of their own left hand. If not, scan again without any mirror "
    "setting.",
)

TWO_BODIES = Reason(
    "two_bodies",
    "There are two large shapes in this scan and we kept only one of them.",
    "Please check that the picture shows the right person, or scan again with nobody else in view.",
)
