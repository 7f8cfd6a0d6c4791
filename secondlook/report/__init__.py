"""The report: one HTML page that tells a mission to somebody who has not read our docs."""

from secondlook.report.page import report_page
from secondlook.report.write import REPORT, write_report

__all__ = ["REPORT", "report_page", "write_report"]
