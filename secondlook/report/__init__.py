"""The report: one HTML page that tells a mission to somebody who has not read our docs."""

from secondlook.report.page import REPORT, report_page, write_report

__all__ = ["REPORT", "report_page", "write_report"]
