from .analysis import resilience_rows as resilience_rows
from .report import resilience_report as resilience_report
